#include "operation/arm_file.h"

#include <algorithm>
#include <cstddef>
#include <stdexcept>
#include <utility>

#include "control/robot_model.h"
#include "control/serial_arm.h"
#include "runtime/configuration/robot_file.h"

namespace operation {
namespace {

/// The file's own URDF gives the masses that the file leaves out; that of this software has the same
/// geometry.
std::string self_contained_text(runtime::ArmModelFile file) {
  runtime::RobotFile& robot = file.robot;
  robot.base = "arm_foot";
  robot.tip = "tip";
  control::SerialArm arm = control::read_serial_arm(control::youbot_urdf(), robot.base, robot.tip);
  for (std::size_t i = 0; i < arm.links.size(); ++i) arm.links[i].inertia = robot.arm.arm.links[i].inertia;
  robot.arm.arm = std::move(arm);
  robot.arm.gravity_B_m_per_s2 = {0, 0, -robot.arm.gravity_B_m_per_s2.norm()};
  robot.arm.p_TP_m = file.model.changes.payload_p_T_m;
  robot.links_changed = true;  // all of them are written
  return runtime::robot_file_text(robot, kArmFileUrdf, robot.arm, {}, {});
}

}  // namespace

std::optional<ArmFile> read_arm_file(runtime::TomlTable& table, std::string_view key,
                                     const std::filesystem::path& folder) {
  std::string name;
  table.text(key, name);
  if (name.empty()) return std::nullopt;
  if (table.is_set(key)) {
    table.refuse(key, "names a file that changes the weight of the arm, which only the configuration may");
    return std::nullopt;
  }
  const std::filesystem::path path = folder / name;
  const auto refuse = [&](const std::string& problem) {
    table.refuse(key, "names a robot file that cannot be used: " + problem);
  };
  try {
    const runtime::ArmModelFile read = runtime::read_arm_model(path);
    return ArmFile{name, path, self_contained_text(read), read.model};
  } catch (const runtime::ConfigError& error) {
    std::ranges::for_each(error.problems(), refuse);
  } catch (const std::runtime_error& error) {
    refuse(path.string() + ": " + error.what());
  }
  return std::nullopt;
}

}  // namespace operation
