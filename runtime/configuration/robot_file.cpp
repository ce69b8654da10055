#include "runtime/configuration/robot_file.h"

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <map>
#include <stdexcept>
#include <utility>

#include "runtime/configuration/base_file.h"
#include "runtime/configuration/closest_name.h"
#include "runtime/configuration/regular_file.h"
#include "runtime/configuration/toml_reader.h"

namespace runtime {
namespace {

using control::ArmDescription;
using control::ArmDrive;

constexpr std::string_view kRobotFormat = "youbot-robot-model/1";
constexpr std::size_t kMaxArmJoints = 32;
constexpr std::size_t kMaxUrdfBytes = std::size_t{16} << 20;
constexpr std::size_t kMaxRipples = 16;
/// Beside the given ones, a delivered model has those that were found.
constexpr std::size_t kMaxRipplesOfDrive = 64;

constexpr double kAny = -1e9;
constexpr double kAnySize = 1e9;
constexpr std::array kDriveKeys{
    DriveKey{"gear_ratio", &ArmDrive::gear_ratio, 1e-6},
    DriveKey{"torque_scale", &ArmDrive::torque_scale, 1e-6},
    DriveKey{"encoder_zero_rad", &ArmDrive::encoder_zero_rad, kAny},
    DriveKey{"compliance_rad_per_Nm", &ArmDrive::compliance_rad_per_Nm, 0},
    DriveKey{"rotor_inertia_kg_m2", &ArmDrive::rotor_inertia_kg_m2, 0},
    DriveKey{"coulomb_Nm", &ArmDrive::coulomb_Nm, 0},
    DriveKey{"viscous_Nm_s_per_rad", &ArmDrive::viscous_Nm_s_per_rad, 0},
    DriveKey{"quadratic_drag_Nm_s2_per_rad2", &ArmDrive::quadratic_drag_Nm_s2_per_rad2, 0},
    DriveKey{"offset_Nm", &ArmDrive::offset_Nm, kAny},
    DriveKey{"load_friction", &ArmDrive::load_friction, 0},
    DriveKey{"stribeck_Nm", &ArmDrive::stribeck_Nm, 0},
    DriveKey{"stribeck_speed_rad_per_s", &ArmDrive::stribeck_speed_rad_per_s, 1e-9},
    DriveKey{"spring_Nm_per_rad", &ArmDrive::spring_Nm_per_rad, kAny},
    DriveKey{"spring_rest_rad", &ArmDrive::spring_rest_rad, kAny},
    DriveKey{"cable_2_Nm_per_rad2", &ArmDrive::cable_2_Nm_per_rad2, kAny},
    DriveKey{"cable_3_Nm_per_rad3", &ArmDrive::cable_3_Nm_per_rad3, kAny},
    DriveKey{"friction_of_previous_Nm", &ArmDrive::friction_of_previous_Nm, 0},
    DriveKey{"friction_of_next_Nm", &ArmDrive::friction_of_next_Nm, 0}};

std::string list_of(const std::vector<std::string>& names) {
  std::string text;
  for (const std::string& name : names) (text += text.empty() ? "" : ", ") += name;
  return text;
}

/// "q{}_rad" and 2 → "q2_rad"
std::string column_name(std::string pattern, std::size_t number) {
  if (const std::size_t at = pattern.find("{}"); at != std::string::npos)
    pattern.replace(at, 2, std::to_string(number));
  return pattern;
}

void read_ripples(TomlTable& table, ArmDrive& drive) {
  for (TomlTable& one : table.tables("ripple", {.most = kMaxRipplesOfDrive})) {
    ArmDrive::Ripple ripple;
    one.number("periods_per_rev", ripple.periods_per_rev, {.min = 1e-6, .max = 1e6, .required = true});
    one.number("sine_Nm", ripple.sine_Nm);
    one.number("cosine_Nm", ripple.cosine_Nm);
    drive.ripples.push_back(ripple);
  }
}

class RobotReader {
 public:
  explicit RobotReader(const std::filesystem::path& path)
      : path_(path), file_(TomlFile::parse(path)), root_(file_.root()) {}

  RobotFile read(const RobotCheck& check) {
    if (const auto key = key_of_base(root_))
      root_.reject(*key, "makes this the description of a base, and an arm is expected");
    std::string format;
    root_.text("format", format, {.required = true});
    if (!format.empty() && format != kRobotFormat)
      root_.refuse("format", fmt::format("is '{}'; this program reads '{}'", format, kRobotFormat));
    root_.text("name", robot_.name);
    root_.number("band_Hz", robot_.band_Hz, {.min = 0.1, .max = 1000});
    root_.list("ripples_per_rev", robot_.ripples_per_rev, {.most = kMaxRipples});
    for (const double ripple : robot_.ripples_per_rev)
      if (!(ripple >= 1e-6 && ripple <= 1e6))
        root_.refuse("ripples_per_rev", "should be from 1e-06 to 1e+06 periods in a turn");
    read_gravity();
    read_urdf();
    read_columns();
    read_drives();
    read_links();
    read_payload();
    file_.finish();
    if (check) refuse(check(robot_));
    return std::move(robot_);
  }

 private:
  void refuse(const std::vector<RobotMisfit>& misfits) {
    for (const RobotMisfit& one : misfits) {
      const auto part = parts_.find({one.table, one.part});
      if (part != parts_.end())
        part->second.refuse(one.key, one.complaint);
      else
        root_.refuse(one.table == "link" ? "urdf" : one.key, one.complaint);
    }
    file_.finish();
  }

  void read_gravity() {
    std::array<double, 3> gravity{0, 0, -model::kGravity_m_per_s2};
    root_.numbers("gravity_m_per_s2", gravity, {.min = -100, .max = 100});
    robot_.arm.gravity_B_m_per_s2 = Eigen::Vector3d(gravity.data());
    if (!(robot_.arm.gravity_B_m_per_s2.norm() > 0)) root_.refuse("gravity_m_per_s2", "should not be zero");
  }

  void read_urdf() {
    std::string urdf;
    root_.text("urdf", urdf, {.required = true});
    root_.text("base", robot_.base, {.required = true});
    root_.text("tip", robot_.tip, {.required = true});
    if (urdf.empty() || robot_.base.empty() || robot_.tip.empty()) return;
    robot_.urdf =
        std::filesystem::path(urdf).is_absolute() ? std::filesystem::path(urdf) : path_.parent_path() / urdf;
    try {
      const std::string text = read_regular_file(robot_.urdf, kMaxUrdfBytes);
      robot_.arm.arm = control::read_serial_arm(text, robot_.base, robot_.tip);
    } catch (const std::runtime_error& why) {
      root_.refuse("urdf", fmt::format("is {}: {}; the path counts from the folder of this file",
                                       robot_.urdf.string(), why.what()));
    } catch (const std::invalid_argument& why) {
      root_.refuse("urdf", fmt::format("is {}: {}", robot_.urdf.string(), why.what()));
    }
    if (robot_.arm.arm.links.size() > kMaxArmJoints)
      root_.refuse("urdf", fmt::format("has {} joints from {} to {}, allowed are {}",
                                       robot_.arm.arm.links.size(), robot_.base, robot_.tip, kMaxArmJoints));
  }

  void read_columns() {
    TomlTable columns = root_.table("columns");
    columns.text("time", robot_.columns.time);
    columns.text("position", position_);
    columns.text("torque", torque_);
  }

  /// By joint, in the order of the arm.
  void read_drives() {
    const std::vector<control::ArmLink>& links = robot_.arm.arm.links;
    const std::size_t joints = links.size();
    std::vector<bool> there(joints, false);
    robot_.arm.drives.resize(joints);
    robot_.columns.position_factor.assign(joints, 1);
    robot_.columns.torque_factor.assign(joints, 1);
    std::vector<std::string> names;
    for (std::size_t i = 0; i < joints; ++i) {
      names.push_back(links[i].joint);
      robot_.arm.drives[i].joint = links[i].joint;
      robot_.columns.position.push_back(column_name(position_, i + 1));
      robot_.columns.torque.push_back(column_name(torque_, i + 1));
    }
    for (TomlTable& table : root_.tables("drive", {.required = true, .most = kMaxArmJoints})) {
      std::string joint;
      table.text("joint", joint, {.required = true});
      const auto found = std::ranges::find(names, joint);
      ArmDrive drive;
      drive.joint = joint;
      const auto at = static_cast<std::size_t>(found - names.begin());
      std::string unused_position;
      std::string unused_torque;
      double unused_factor = 1;
      const bool known = found != names.end();
      for (const DriveKey& key : kDriveKeys)
        table.number(key.key, drive.*(key.member), {.min = key.lower, .max = kAnySize});
      table.text("position_column", known ? robot_.columns.position[at] : unused_position);
      table.text("torque_column", known ? robot_.columns.torque[at] : unused_torque);
      const NumberRules factor{.min = kAny, .max = kAnySize};
      table.number("position_factor", known ? robot_.columns.position_factor[at] : unused_factor, factor);
      table.number("torque_factor", known ? robot_.columns.torque_factor[at] : unused_factor, factor);
      for (const char* key : {"position_factor", "torque_factor"})
        if (known && (key[0] == 'p' ? robot_.columns.position_factor : robot_.columns.torque_factor)[at] == 0)
          table.refuse(key, "is zero: nothing would be read");
      table.boolean("friction_before_gear", drive.friction_before_gear);
      read_ripples(table, drive);
      if (joint.empty() || names.empty()) continue;
      if (!known) {
        table.refuse("joint", fmt::format("is '{}', which does not move between {} and {}; these do: {}",
                                          joint, robot_.base, robot_.tip, list_of(names)));
        continue;
      }
      if (there[at]) table.refuse("joint", fmt::format("is '{}' again: a joint has one drive", joint));
      there[at] = true;
      robot_.arm.drives[at] = drive;
      parts_.emplace(std::pair("drive", joint), table);
    }
    refuse_shared_columns(names);
    std::vector<std::string> missing;
    for (std::size_t i = 0; i < joints; ++i)
      if (!there[i]) missing.push_back(names[i]);
    if (!missing.empty() && root_.has("drive"))
      root_.refuse("drive", fmt::format("is missing for {}: every joint that moves between base and tip has "
                                        "one [[drive]] with joint = \"NAME\"",
                                        list_of(missing)));
  }

  void refuse_shared_columns(const std::vector<std::string>& names) {
    std::map<std::string, std::string> used;
    for (std::size_t i = 0; i < names.size(); ++i)
      for (const bool position : {true, false}) {
        const std::string& column = (position ? robot_.columns.position : robot_.columns.torque)[i];
        const std::string what = (position ? "position of " : "torque of ") + names[i];
        const auto [other, is_new] = used.emplace(column, what);
        if (!is_new)
          root_.refuse(
              root_.has("columns") ? "columns" : "drive",
              fmt::format("gives '{}' as the {} and as the {}: write {{}} for the number of the joint",
                          column, other->second, what));
      }
  }

  void read_links() {
    for (TomlTable& table : root_.tables("link", {.most = kMaxArmJoints})) {
      std::string name;
      table.text("name", name, {.required = true});
      const auto link = std::ranges::find(robot_.arm.arm.links, name, &control::ArmLink::link);
      control::LinkInertia body;
      if (link != robot_.arm.arm.links.end()) body = link->inertia;
      const Eigen::Matrix3d& I = body.about_C_kg_m2;
      std::array<double, 3> centre{body.p_LC_m.x(), body.p_LC_m.y(), body.p_LC_m.z()};
      std::array<double, 6> inertia{I(0, 0), I(0, 1), I(0, 2), I(1, 1), I(1, 2), I(2, 2)};
      table.number("mass_kg", body.mass_kg, {.min = 0, .max = 1e6});
      table.numbers("centre_m", centre, {.min = -1e3, .max = 1e3});
      table.numbers("inertia_kg_m2", inertia, {.min = -1e6, .max = 1e6});
      if (link == robot_.arm.arm.links.end()) {
        std::vector<std::string> names;
        for (const control::ArmLink& one : robot_.arm.arm.links) names.push_back(one.link);
        if (!names.empty())
          table.refuse("name", fmt::format("is '{}', which no joint moves; these links move: {}", name,
                                           list_of(names)));
        continue;
      }
      body.p_LC_m = Eigen::Vector3d(centre.data());
      body.about_C_kg_m2 << inertia[0], inertia[1], inertia[2], inertia[1], inertia[3], inertia[4],
          inertia[2], inertia[4], inertia[5];
      if (parts_.contains({"link", name}))
        table.refuse("name", fmt::format("is '{}' again: a link has one table", name));
      link->inertia = body;
      robot_.links_changed = true;
      parts_.emplace(std::pair("link", name), table);
    }
  }

  void read_payload() {
    TomlTable payload = root_.table("payload");
    parts_.emplace(std::pair("payload", ""), payload);
    payload.number("mass_kg", robot_.arm.payload_kg, {.min = 0, .max = 1e6});
    std::array<double, 3> centre{0, 0, 0};
    payload.numbers("centre_m", centre, {.min = -1e3, .max = 1e3});
    robot_.arm.p_TP_m = Eigen::Vector3d(centre.data());
  }

  std::filesystem::path path_;
  TomlFile file_;
  TomlTable root_;
  std::map<std::pair<std::string, std::string>, TomlTable> parts_;  // by table and part, for refuse()
  RobotFile robot_;
  std::string position_ = "q{}_rad";
  std::string torque_ = "tau{}_Nm";
};

template <class Numbers>
std::string robot_numbers(const Numbers& values) {
  std::string text;
  for (const double value : values) text += (text.empty() ? "[" : ", ") + toml_number(value);
  return text + "]";
}

class RobotWriter {
 public:
  RobotWriter(const RobotFile& robot, const ArmDescription& given, std::span<const RobotRemark> remarks)
      : robot_(robot), given_(given), remarks_(remarks) {}

  std::string text(const std::filesystem::path& urdf, std::span<const std::string> header) {
    for (const std::string& line : header) text_ += toml_comment(line) + "\n";
    text_ += fmt::format("format = \"{}\"\nname = {}\nurdf = {}\nbase = {}\ntip = {}\nband_Hz = {}\n",
                         kRobotFormat, toml_string(robot_.name), toml_string(urdf.generic_string()),
                         toml_string(robot_.base), toml_string(robot_.tip), toml_number(robot_.band_Hz));
    if (!robot_.ripples_per_rev.empty())
      text_ += fmt::format("ripples_per_rev = {}\n", robot_numbers(robot_.ripples_per_rev));
    remark("base");
    const Eigen::Vector3d& g = robot_.arm.gravity_B_m_per_s2;
    text_ += fmt::format("gravity_m_per_s2 = {}\n", robot_numbers(std::array{g.x(), g.y(), g.z()}));
    if (!robot_.columns.time.empty())
      text_ += fmt::format("\n[columns]\ntime = {}\n", toml_string(robot_.columns.time));
    for (std::size_t i = 0; i < robot_.arm.drives.size(); ++i) write_drive(i);
    for (std::size_t i = 0; i < robot_.arm.arm.links.size(); ++i) write_link(i);
    if (robot_.arm.payload_kg > 0) {
      const Eigen::Vector3d& p = robot_.arm.p_TP_m;
      text_ += "\n";
      remark("tip");
      text_ += fmt::format("[payload]\nmass_kg = {}\ncentre_m = {}\n", toml_number(robot_.arm.payload_kg),
                           robot_numbers(std::array{p.x(), p.y(), p.z()}));
    }
    return text_;
  }

 private:
  void remark(std::string_view part) {
    for (const RobotRemark& one : remarks_)
      if (one.part == part) text_ += toml_comment(one.text) + "\n";
  }

  void write_drive(std::size_t i) {
    const ArmDrive& drive = robot_.arm.drives[i];
    const ArmDrive usual;
    text_ += "\n";
    remark(drive.joint);
    text_ += fmt::format("[[drive]]\njoint = {}\n", toml_string(drive.joint));
    for (const DriveKey& key : kDriveKeys) {
      const double value = drive.*(key.member);
      if (value != usual.*(key.member) || value != given_.drives[i].*(key.member))
        text_ += fmt::format("{} = {}\n", key.key, toml_number(value));
    }
    const RobotFile::Columns& columns = robot_.columns;
    text_ += fmt::format("position_column = {}\ntorque_column = {}\n", toml_string(columns.position[i]),
                         toml_string(columns.torque[i]));
    if (columns.position_factor[i] != 1)
      text_ += fmt::format("position_factor = {}\n", toml_number(columns.position_factor[i]));
    if (columns.torque_factor[i] != 1)
      text_ += fmt::format("torque_factor = {}\n", toml_number(columns.torque_factor[i]));
    if (drive.friction_before_gear) text_ += "friction_before_gear = true\n";
    for (const ArmDrive::Ripple& ripple : drive.ripples) {
      text_ += fmt::format("[[drive.ripple]]\nperiods_per_rev = {}\nsine_Nm = {}\ncosine_Nm = {}\n",
                           toml_number(ripple.periods_per_rev), toml_number(ripple.sine_Nm),
                           toml_number(ripple.cosine_Nm));
    }
  }

  void write_link(std::size_t i) {
    const control::ArmLink& link = robot_.arm.arm.links[i];
    const control::LinkInertia& given = given_.arm.links[i].inertia;
    const control::LinkInertia& body = link.inertia;
    const bool same = body.mass_kg == given.mass_kg && body.p_LC_m == given.p_LC_m &&
                      body.about_C_kg_m2 == given.about_C_kg_m2;
    if (same && !robot_.links_changed) return;
    const Eigen::Vector3d& c = body.p_LC_m;
    const Eigen::Matrix3d& I = body.about_C_kg_m2;
    text_ += "\n";
    remark(link.link);
    text_ += fmt::format(
        "[[link]]\nname = {}\nmass_kg = {}\ncentre_m = {}\ninertia_kg_m2 = {}  # about the centre: xx, xy, "
        "xz, "
        "yy, yz, zz\n",
        toml_string(link.link), toml_number(body.mass_kg), robot_numbers(std::array{c.x(), c.y(), c.z()}),
        robot_numbers(std::array{I(0, 0), I(0, 1), I(0, 2), I(1, 1), I(1, 2), I(2, 2)}));
  }

  const RobotFile& robot_;
  const ArmDescription& given_;
  std::span<const RobotRemark> remarks_;
  std::string text_;
};

}  // namespace

bool is_robot_file(const std::filesystem::path& path) {
  TomlFile file = TomlFile::parse(path);
  std::string format;
  file.root().text("format", format);
  return format.starts_with(kRobotFormat.substr(0, kRobotFormat.rfind('/') + 1));
}

std::span<const DriveKey> drive_keys() noexcept { return kDriveKeys; }

RobotFile read_robot_file(const std::filesystem::path& path, const RobotCheck& check) {
  return RobotReader(path).read(check);
}

std::string robot_file_text(const RobotFile& robot, const std::filesystem::path& urdf,
                            const ArmDescription& given, std::span<const std::string> header,
                            std::span<const RobotRemark> remarks) {
  return RobotWriter(robot, given, remarks).text(urdf, header);
}

}  // namespace runtime
