#include "apps/youbot_bench/given_arm.h"

#include <algorithm>
#include <cstddef>
#include <stdexcept>

#include "control/robot_model.h"
#include "control/whole_body_controller.h"
#include "hal/youbot_axes.h"

namespace youbot_bench {
namespace {

constexpr const char* kFoot = "arm_foot";
constexpr const char* kTip = "tip";
/// Rounding of URDFs.
constexpr double kSamePlace = 1e-3;

}  // namespace

runtime::RobotFile described_arm() {
  runtime::RobotFile robot;
  robot.name = "youbot-arm";
  robot.base = kFoot;
  robot.tip = kTip;
  robot.arm.arm = control::read_serial_arm(control::youbot_urdf(), kFoot, kTip);
  const control::WholeBodyController::Config usual;
  for (std::size_t i = 0; i < robot.arm.arm.links.size(); ++i) {
    control::ArmDrive drive;
    drive.joint = robot.arm.arm.links[i].joint;
    drive.gear_ratio = hal::kArmAxes[i].constants.gear_ratio;
    drive.rotor_inertia_kg_m2 = usual.rotor_inertia_kg_m2[i];
    drive.coulomb_Nm = usual.arm_friction.coulomb_Nm[i];
    drive.viscous_Nm_s_per_rad = usual.arm_friction.viscous_Nm_s_per_rad[i];
    robot.arm.drives.push_back(drive);
    const std::string columns = "arm_" + std::to_string(i + 1);
    robot.columns.position.push_back(columns + "_position_rad");
    robot.columns.torque.push_back(columns + "_torque_measured_Nm");
    robot.columns.position_factor.push_back(1);
    robot.columns.torque_factor.push_back(1);
  }
  robot.columns.time = "time_s";
  return robot;
}

runtime::RobotFile read_given_arm(const std::filesystem::path& path, const std::string& option) {
  runtime::RobotFile robot = runtime::read_robot_file(path);
  const control::SerialArm ours = described_arm().arm.arm;
  const bool has_its_joints = std::ranges::equal(robot.arm.arm.links, ours.links, {},
                                                 &control::ArmLink::joint, &control::ArmLink::joint);
  if (!has_its_joints)
    throw std::invalid_argument(option + ": " + path.string() +
                                " does not move the joints of the youBot's arm");
  for (std::size_t i = 1; i < ours.links.size(); ++i)
    if (!robot.arm.arm.links[i].X_PL.isApprox(ours.links[i].X_PL, kSamePlace))
      throw std::invalid_argument(option + ": " + path.string() + " has " + ours.links[i].joint +
                                  " at another place or zero than control/youbot.urdf");
  // The recordings are this program's own.
  robot.columns = described_arm().columns;
  return robot;
}

}  // namespace youbot_bench
