#include "runtime/configuration/base_file.h"

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <map>
#include <numbers>
#include <optional>
#include <stdexcept>
#include <utility>

#include "control/base_rolling.h"
#include "runtime/configuration/base_file_keys.h"
#include "runtime/configuration/toml_reader.h"

namespace runtime {
namespace {

using control::BaseDescription;
using control::BaseKinematics;

constexpr std::size_t kMaxBaseWheels = 16;
constexpr std::size_t kMaxFloors = 32;
constexpr std::size_t kMaxRecordingsOfFloor = 1000;
/// Of lengths, and of factors beside zero.
constexpr double kShortest_m = 1e-6;
constexpr double kLongest_m = 1e3;
constexpr double kLargestFactor = 1e9;
constexpr double kAnyAngle_rad = 1e3;
/// Of masses, inertias, forces and torques.
constexpr double kLightest_kg = 1e-6;
constexpr double kLargestForce = 1e9;
constexpr double kSteepestFloor = 1;
/// Windows of recordings at any rate.
constexpr double kShortestBaseWindow_s = 0.01;
constexpr double kLongestBaseWindow_s = 100;

const char* wheels_needed(BaseKinematics kinematics) {
  switch (kinematics) {
    case BaseKinematics::kDifferential: return R"(two, with name = "left" and name = "right")";
    case BaseKinematics::kTricycle: return R"(one)";
    case BaseKinematics::kOmni: return "three or more, each with its angle_rad";
    case BaseKinematics::kMecanum: return "four: front left, front right, rear left, rear right";
  }
  return "";
}

class BaseReader {
 public:
  explicit BaseReader(const std::filesystem::path& path)
      : file_(TomlFile::parse(path)), root_(file_.root()) {}

  BaseFile read() {
    std::string format;
    root_.text("format", format, {.required = true});
    if (!format.empty() && format != kBaseFormat)
      root_.refuse("format", fmt::format("is '{}'; this program reads '{}'", format, kBaseFormat));
    root_.text("name", result_.name);
    read_base();
    read_columns();
    read_wheels();
    read_tracking();
    read_slip();
    read_slope();
    read_floors();
    refuse_shared_columns();
    file_.finish();
    return std::move(result_);
  }

 private:
  BaseDescription& base() { return result_.base; }

  void read_base() {
    TomlTable table = root_.table("base", {.required = true});
    if (!root_.has("base")) return;
    table.choice("kinematics", base().kinematics,
                 std::span<const std::pair<std::string_view, BaseKinematics>>(kBaseKinematics),
                 {.required = true});
    std::string kinematics;
    if (table.has("kinematics")) table.text("kinematics", kinematics);
    known_ = std::ranges::any_of(kBaseKinematics, [&](const auto& one) { return one.first == kinematics; });
    if (!known_) {
      // Which keys there are depends on it.
      for (const char* const key :
           {"window_s", "track_m", "wheelbase_m", "radius_m", "turning_length_m", "steering_offset_rad",
            "mass_kg", "yaw_inertia_kg_m2", "centre_m", "sideways_resistance_N", "turning_resistance_Nm"})
        table.ignore(key);
      return;
    }
    table.number("window_s", result_.window_s, {.min = kShortestBaseWindow_s, .max = kLongestBaseWindow_s});
    const NumberRules length{.min = kShortest_m, .max = kLongest_m, .required = true};
    if (base().kinematics == BaseKinematics::kMecanum) {
      table.number("wheelbase_m", result_.wheelbase_m, length);
      table.number("track_m", result_.track_m, length);
      base().turning_length_m = 0.5 * (result_.wheelbase_m + result_.track_m);
      table.number("turning_length_m", base().turning_length_m, {.min = kShortest_m, .max = kLongest_m});
    } else {
      table.number(control::turning_length_name(base().kinematics), base().turning_length_m, length);
    }
    if (base().kinematics == BaseKinematics::kTricycle)
      table.number("steering_offset_rad", base().steering_offset_rad,
                   {.min = -std::numbers::pi, .max = std::numbers::pi});
    read_body(table);
  }

  void read_body(TomlTable& table) {
    BaseDescription::Body& body = base().body;
    const NumberRules positive{.min = 0, .max = kLargestForce};
    table.number("mass_kg", body.mass_kg, {.min = kLightest_kg, .max = kLargestForce});
    table.number("yaw_inertia_kg_m2", body.yaw_inertia_kg_m2, positive);
    std::array<double, 2> centre{0, 0};
    table.numbers("centre_m", centre, {.min = -kLongest_m, .max = kLongest_m});
    body.p_BC_m = Eigen::Vector2d(centre.data());
    if (base().kinematics == BaseKinematics::kOmni || base().kinematics == BaseKinematics::kMecanum)
      table.number("sideways_resistance_N", body.sideways_resistance_N, positive);
    table.number("turning_resistance_Nm", body.turning_resistance_Nm, positive);
  }

  void read_slope() {
    TomlTable table = root_.table("floor_slope");
    const NumberRules slope{.min = -kSteepestFloor, .max = kSteepestFloor};
    table.number("x", base().body.slope.x(), slope);
    table.number("y", base().body.slope.y(), slope);
  }

  void read_columns() {
    TomlTable table = root_.table("columns");
    BaseFile::Columns& columns = result_.columns;
    table.text("time", columns.time);
    table.text("run", columns.run);
    if (!known_) {
      table.ignore("steering");
      table.ignore("steering_factor");
    }
    if (!known_ || base().kinematics != BaseKinematics::kTricycle) return;
    table.text("steering", columns.steering, {.required = true});
    read_factor(table, "steering_factor", columns.steering_factor);
  }

  void read_factor(TomlTable& table, const char* key, double& factor) {
    table.number(key, factor, {.min = -kLargestFactor, .max = kLargestFactor});
    if (factor == 0) table.refuse(key, "is zero: nothing would be read");
  }

  void read_wheels() {
    const bool omni = base().kinematics == BaseKinematics::kOmni;
    for (TomlTable& table : root_.tables("wheel", {.required = true, .most = kMaxBaseWheels})) {
      BaseDescription::Wheel wheel;
      BaseFile::Columns::Wheel columns;
      table.text("name", wheel.name, {.required = true});
      table.number("radius_m", wheel.radius_m, {.min = kShortest_m, .max = kLongest_m, .required = true});
      if (!known_) table.ignore("angle_rad");
      if (known_ && omni)
        table.number("angle_rad", wheel.angle_rad,
                     {.min = -kAnyAngle_rad, .max = kAnyAngle_rad, .required = true});
      table.text("position_column", columns.position);
      table.text("speed_column", columns.speed);
      if (columns.position.empty() == columns.speed.empty())
        table.refuse("name",
                     fmt::format("is '{}', which needs either position_column, its accumulated angle, "
                                 "or speed_column, its speed; exactly one of them",
                                 wheel.name));
      read_factor(table, "factor", columns.factor);
      table.text("load_column", columns.load);
      read_torque(table, wheel, columns);
      if (std::ranges::find(base().wheels, wheel.name, &BaseDescription::Wheel::name) != base().wheels.end())
        table.refuse("name", fmt::format("is '{}' again: each wheel has its own name", wheel.name));
      base().wheels.push_back(std::move(wheel));
      result_.columns.wheels.push_back(std::move(columns));
    }
    const auto has_none = [](const BaseFile::Columns::Wheel& one) { return one.torque.empty(); };
    const auto none = std::ranges::find_if(result_.columns.wheels, has_none);
    if (none != result_.columns.wheels.end() && !std::ranges::all_of(result_.columns.wheels, has_none))
      root_.refuse(
          "wheel",
          fmt::format("'{}' has no torque_column, but others have one: forces on the base "
                      "need the torques of all wheels; add it, or remove all",
                      base().wheels[static_cast<std::size_t>(none - result_.columns.wheels.begin())].name));
    if (known_ && root_.has("wheel")) check_wheels();
  }

  void read_torque(TomlTable& table, BaseDescription::Wheel& wheel, BaseFile::Columns::Wheel& columns) {
    table.text("torque_column", columns.torque);
    read_factor(table, "torque_factor", columns.torque_factor);
    table.number("torque_scale", wheel.torque_scale, {.min = 1e-6, .max = 1e6});
    table.number("offset_Nm", wheel.offset_Nm, {.min = -kLargestForce, .max = kLargestForce});
    const NumberRules positive{.min = 0, .max = kLargestForce};
    table.number("inertia_kg_m2", wheel.inertia_kg_m2, positive);
    table.number("coulomb_Nm", wheel.coulomb_Nm, positive);
    table.number("viscous_Nm_s_per_rad", wheel.viscous_Nm_s_per_rad, positive);
    if (known_ && !columns.torque.empty() && base().body.mass_kg == 0)
      table.refuse(
          "torque_column",
          fmt::format("is '{}', but [base] has no mass_kg: torques are compared with the forces that "
                      "the base needs; weigh it and write mass_kg, or remove torque_column of all "
                      "wheels",
                      columns.torque));
  }

  void check_wheels() {
    const auto wrong = [&] {
      root_.refuse("wheel", fmt::format("is there {} times; a base that is {} has {}", base().wheels.size(),
                                        name_of(base().kinematics), wheels_needed(base().kinematics)));
    };
    const std::size_t count = base().wheels.size();
    switch (base().kinematics) {
      case BaseKinematics::kDifferential: {
        const auto at = [&](const char* name) {
          return std::ranges::find(base().wheels, name, &BaseDescription::Wheel::name) -
                 base().wheels.begin();
        };
        const auto left = static_cast<std::size_t>(at("left"));
        if (count != 2 || left == 2 || at("right") == 2) return wrong();
        if (left == 1) {
          std::swap(base().wheels[0], base().wheels[1]);
          std::swap(result_.columns.wheels[0], result_.columns.wheels[1]);
        }
        return;
      }
      case BaseKinematics::kTricycle:
        if (count != 1) wrong();
        return;
      case BaseKinematics::kMecanum:
        if (count != 4) wrong();
        return;
      case BaseKinematics::kOmni: break;
    }
    if (count < 3) return wrong();
    try {
      if (base().turning_length_m > 0) const control::BaseRolling rolling(base());
    } catch (const std::invalid_argument&) {
      root_.refuse("wheel",
                   "has angles by which the wheels do not determine a motion in every direction; "
                   "check angle_rad");
    }
  }

  static std::string_view name_of(BaseKinematics kinematics) {
    return std::ranges::find(kBaseKinematics, kinematics,
                             &std::pair<std::string_view, BaseKinematics>::second)
        ->first;
  }

  void read_tracking() {
    TomlTable table = root_.table("tracking", {.required = true});
    if (!root_.has("tracking")) return;
    BaseFile::Columns& columns = result_.columns;
    BaseDescription::Tracking& tracking = base().tracking;
    table.text("x_column", columns.x, {.required = true});
    table.text("y_column", columns.y, {.required = true});
    table.text("heading_column", columns.heading, {.required = true});
    read_factor(table, "position_factor", columns.position_factor);
    read_factor(table, "heading_factor", columns.heading_factor);
    table.boolean("mirrored", columns.mirrored);
    std::array<double, 2> offset{0, 0};
    table.numbers("offset_m", offset, {.min = -kLongest_m, .max = kLongest_m});
    tracking.p_BT_m = Eigen::Vector2d(offset.data());
    table.number("yaw_rad", tracking.yaw_BT_rad, {.min = -kAnyAngle_rad, .max = kAnyAngle_rad});
    table.number("scale", tracking.scale, {.min = 1e-6, .max = 1e6});
  }

  void read_slip() {
    TomlTable table = root_.table("slip");
    const NumberRules share{.min = 0, .max = 1};
    table.number("forward", base().slip_forward, share);
    table.number("sideways", base().slip_sideways, share);
    table.number("with_load", base().slip_with_load, {.min = 0, .max = kLargestFactor});
  }

  void read_floors() {
    std::map<std::string, std::string> used;
    for (TomlTable& table : root_.tables("floor", {.most = kMaxFloors})) {
      BaseDescription::Floor floor;
      std::vector<std::string> recordings;
      table.text("name", floor.name, {.required = true});
      table.texts("recordings", recordings, {.required = true, .most = kMaxRecordingsOfFloor});
      table.number("slip", floor.slip, {.min = 0, .max = 1});
      table.number("resistance_N", floor.resistance_N, {.min = 0, .max = kLargestForce});
      if (std::ranges::find(base().floors, floor.name, &BaseDescription::Floor::name) != base().floors.end())
        table.refuse("name", fmt::format("is '{}' again: each floor has its own name", floor.name));
      for (const std::string& one : recordings)
        if (const auto [other, is_new] = used.emplace(one, floor.name); !is_new)
          table.refuse("recordings", fmt::format("has '{}', as floor '{}' has: a recording is on one floor",
                                                 one, other->second));
      base().floors.push_back(std::move(floor));
      result_.floor_recordings.push_back(std::move(recordings));
    }
  }

  void refuse_shared_columns() {
    std::map<std::string, std::string> used;
    const auto use = [&](const std::string& column, const std::string& what, const char* key) {
      if (column.empty()) return;
      if (const auto [other, is_new] = used.emplace(column, what); !is_new)
        root_.refuse(key, fmt::format("gives '{}' as the {} and as the {}: each has its own column", column,
                                      other->second, what));
    };
    const BaseFile::Columns& columns = result_.columns;
    use(columns.time, "time", "columns");
    use(columns.run, "run", "columns");
    use(columns.steering, "steering angle", "columns");
    for (std::size_t w = 0; w < columns.wheels.size(); ++w) {
      const std::string of = " of wheel " + base().wheels[w].name;
      use(columns.wheels[w].position, "angle" + of, "wheel");
      use(columns.wheels[w].speed, "speed" + of, "wheel");
      // A current may be both.
      if (columns.wheels[w].load != columns.wheels[w].torque)
        use(columns.wheels[w].load, "load" + of, "wheel");
      use(columns.wheels[w].torque, "torque" + of, "wheel");
    }
    use(columns.x, "x of the tracked body", "tracking");
    use(columns.y, "y of the tracked body", "tracking");
    use(columns.heading, "heading of the tracked body", "tracking");
  }

  TomlFile file_;
  TomlTable root_;
  BaseFile result_;
  bool known_ = false;  // the kinematics
};

}  // namespace

int BaseFile::floor_of(std::string_view recording) const {
  int best = -1;
  std::size_t longest = 0;
  for (std::size_t f = 0; f < floor_recordings.size(); ++f)
    for (const std::string& beginning : floor_recordings[f]) {
      if (!recording.starts_with(beginning) || (best >= 0 && beginning.size() <= longest)) continue;
      best = static_cast<int>(f);
      longest = beginning.size();
    }
  return best;
}

std::optional<std::string_view> key_of_base(const TomlTable& root) {
  if (root.has("urdf")) return std::nullopt;
  if (root.has_table("base")) return "base";
  for (const std::string_view key : {"wheel", "tracking"})
    if (root.has(key)) return key;
  return std::nullopt;
}

bool describes_base(const std::filesystem::path& path) {
  TomlFile file = TomlFile::parse(path);
  return key_of_base(file.root()).has_value();
}

BaseFile read_base_file(const std::filesystem::path& path) { return BaseReader(path).read(); }

}  // namespace runtime
