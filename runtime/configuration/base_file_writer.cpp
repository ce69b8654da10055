#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <cstddef>
#include <utility>

#include "runtime/configuration/base_file.h"
#include "runtime/configuration/base_file_keys.h"
#include "runtime/configuration/toml_reader.h"

namespace runtime {
namespace {

using control::BaseDescription;
using control::BaseKinematics;

class BaseWriter {
 public:
  BaseWriter(const BaseFile& file, std::span<const RobotRemark> remarks) : file_(file), remarks_(remarks) {}

  std::string text(std::span<const std::string> header) {
    for (const std::string& line : header) text_ += toml_comment(line) + "\n";
    line("format", toml_string(kBaseFormat));
    line("name", toml_string(file_.name));
    write_base();
    write_columns();
    for (std::size_t w = 0; w < base().wheels.size(); ++w) write_wheel(w);
    write_tracking();
    const BaseDescription& b = base();
    if (b.slip_forward != 0 || b.slip_sideways != 0 || b.slip_with_load != 0) {
      text_ += "\n[slip]\n";
      number("forward", b.slip_forward);
      number("sideways", b.slip_sideways);
      number("with_load", b.slip_with_load);
    }
    if (b.body.slope != Eigen::Vector2d::Zero()) {
      text_ += "\n";
      remark("floor");
      text_ += "[floor_slope]\n";
      number("x", b.body.slope.x());
      number("y", b.body.slope.y());
    }
    for (std::size_t f = 0; f < b.floors.size(); ++f) write_floor(f);
    return text_;
  }

 private:
  const BaseDescription& base() const { return file_.base; }
  void line(std::string_view key, const std::string& value) { text_ += fmt::format("{} = {}\n", key, value); }
  void number(std::string_view key, double value) { line(key, toml_number(value)); }
  void number_unless(std::string_view key, double value, double usual) {
    if (value != usual) number(key, value);
  }
  void name(std::string_view key, const std::string& value) {
    if (!value.empty()) line(key, toml_string(value));
  }
  void remark(std::string_view part) {
    for (const RobotRemark& one : remarks_)
      if (one.part == part) text_ += toml_comment(one.text) + "\n";
  }

  void write_base() {
    text_ += "\n";
    remark("base");
    remark("steering");
    text_ += "[base]\n";
    const auto kinematics = std::ranges::find(kBaseKinematics, base().kinematics,
                                              &std::pair<std::string_view, BaseKinematics>::second);
    line("kinematics", toml_string(kinematics->first));
    if (base().kinematics == BaseKinematics::kMecanum) {
      number("wheelbase_m", file_.wheelbase_m);
      number("track_m", file_.track_m);
      if (base().turning_length_m == 0.5 * (file_.wheelbase_m + file_.track_m)) return end_base();
    }
    number(control::turning_length_name(base().kinematics), base().turning_length_m);
    end_base();
  }
  void end_base() {
    if (base().steering_offset_rad != 0) number("steering_offset_rad", base().steering_offset_rad);
    if (file_.window_s > 0) number("window_s", file_.window_s);
    const BaseDescription::Body& body = base().body;
    number_unless("mass_kg", body.mass_kg, 0);
    number_unless("yaw_inertia_kg_m2", body.yaw_inertia_kg_m2, 0);
    if (body.p_BC_m != Eigen::Vector2d::Zero())
      line("centre_m", fmt::format("[{}, {}]", toml_number(body.p_BC_m.x()), toml_number(body.p_BC_m.y())));
    number_unless("sideways_resistance_N", body.sideways_resistance_N, 0);
    number_unless("turning_resistance_Nm", body.turning_resistance_Nm, 0);
  }

  void write_columns() {
    const BaseFile::Columns& columns = file_.columns;
    if (columns.time.empty() && columns.run.empty() && columns.steering.empty()) return;
    text_ += "\n[columns]\n";
    name("time", columns.time);
    name("run", columns.run);
    name("steering", columns.steering);
    if (columns.steering_factor != 1) number("steering_factor", columns.steering_factor);
  }

  void write_wheel(std::size_t w) {
    const BaseDescription::Wheel& wheel = base().wheels[w];
    const BaseFile::Columns::Wheel& columns = file_.columns.wheels[w];
    text_ += "\n";
    remark(wheel.name);
    text_ += "[[wheel]]\n";
    line("name", toml_string(wheel.name));
    number("radius_m", wheel.radius_m);
    if (base().kinematics == BaseKinematics::kOmni) number("angle_rad", wheel.angle_rad);
    name("position_column", columns.position);
    name("speed_column", columns.speed);
    if (columns.factor != 1) number("factor", columns.factor);
    name("load_column", columns.load);
    name("torque_column", columns.torque);
    number_unless("torque_factor", columns.torque_factor, 1);
    number_unless("torque_scale", wheel.torque_scale, 1);
    number_unless("offset_Nm", wheel.offset_Nm, 0);
    number_unless("inertia_kg_m2", wheel.inertia_kg_m2, 0);
    number_unless("coulomb_Nm", wheel.coulomb_Nm, 0);
    number_unless("viscous_Nm_s_per_rad", wheel.viscous_Nm_s_per_rad, 0);
  }

  void write_tracking() {
    const BaseFile::Columns& columns = file_.columns;
    const BaseDescription::Tracking& tracking = base().tracking;
    text_ += "\n";
    remark("tracking");
    text_ += "[tracking]\n";
    name("x_column", columns.x);
    name("y_column", columns.y);
    name("heading_column", columns.heading);
    if (columns.position_factor != 1) number("position_factor", columns.position_factor);
    if (columns.heading_factor != 1) number("heading_factor", columns.heading_factor);
    if (columns.mirrored) line("mirrored", "true");
    line("offset_m",
         fmt::format("[{}, {}]", toml_number(tracking.p_BT_m.x()), toml_number(tracking.p_BT_m.y())));
    number("yaw_rad", tracking.yaw_BT_rad);
    if (tracking.scale != 1) number("scale", tracking.scale);
  }

  void write_floor(std::size_t f) {
    const BaseDescription::Floor& floor = base().floors[f];
    text_ += "\n";
    remark(floor.name);
    text_ += "[[floor]]\n";
    line("name", toml_string(floor.name));
    std::string list;
    for (const std::string& one : file_.floor_recordings[f])
      list += (list.empty() ? "" : ", ") + toml_string(one);
    line("recordings", "[" + list + "]");
    number_unless("slip", floor.slip, 0);
    number_unless("resistance_N", floor.resistance_N, 0);
  }

  const BaseFile& file_;
  std::span<const RobotRemark> remarks_;
  std::string text_;
};

}  // namespace

std::string base_file_text(const BaseFile& file, std::span<const std::string> header,
                           std::span<const RobotRemark> remarks) {
  return BaseWriter(file, remarks).text(header);
}

}  // namespace runtime
