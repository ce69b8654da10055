#include "runtime/open_robot.h"

#include <stdexcept>
#include <vector>

#include "drivers/ethercat/lock_step_link.h"
#include "drivers/ethercat/raw_socket_link.h"
#include "drivers/ethercat/simulated_bus.h"
#include "hal/axis_scale.h"
#include "hal/loopback_robot.h"
#include "hal/youbot_axes.h"
#include "runtime/simulated_arm.h"
#include "runtime/wire_robot.h"

namespace runtime {
namespace {

std::vector<hal::JointInfo> wheel_joints() {
  std::vector<hal::JointInfo> joints;
  for (const char* name : {"wheel-1", "wheel-2", "wheel-3", "wheel-4"})
    joints.push_back(hal::joint_info(name, hal::kWheelAxis));
  return joints;
}

std::vector<hal::JointInfo> wheel_and_arm_joints() {
  std::vector<hal::JointInfo> joints = wheel_joints();
  for (std::size_t i = 0; i < hal::kArmAxes.size(); ++i)
    joints.push_back(hal::joint_info("arm-" + std::to_string(i + 1), hal::kArmAxes[i]));
  return joints;
}

/// The simulated drive has the real axis data: gear, motor constant, current limit and sensor counts.
sim::BaseParameters with_youbot_wheels(sim::BaseParameters parameters) {
  const hal::AxisData& axis = hal::kWheelAxis;
  const hal::AxisScale scale(axis.constants);
  parameters.drive.gear_ratio = axis.constants.gear_ratio;
  parameters.drive.motor.torque_constant_Nm_per_A = axis.constants.torque_constant_Nm_per_A;
  parameters.drive.motor.current_limit_A = axis.current_limit_A;
  parameters.drive.sensors.position_resolution_rad = scale.position_resolution_rad();
  parameters.drive.sensors.velocity_resolution_rad_per_s = scale.velocity_resolution_rad_per_s();
  parameters.drive.sensors.torque_resolution_Nm = scale.torque_resolution_Nm();
  return parameters;
}

bool names_interface(const std::string& name, std::string_view prefix) {
  return name.starts_with(prefix) && name.size() > prefix.size();
}

/// The last second: one frame out and one back per cycle.
std::unique_ptr<drivers::ethercat::PcapRing> make_capture(const std::string& interface) {
  return std::make_unique<drivers::ethercat::PcapRing>(
      drivers::ethercat::PcapRing::Options{.interface = interface, .frames = 2000});
}

/// youbot-sim --lock-step, at the other end of a network interface.
std::unique_ptr<hal::Robot> lock_step_robot(const std::string& interface, const hal::EthercatOptions& options,
                                            bool lifted, const hal::Clock& clock,
                                            std::chrono::nanoseconds period) {
  namespace ethercat = drivers::ethercat;
  if (period != ethercat::kLockStepPeriod)
    throw std::invalid_argument("in lock-step a cycle takes 1 ms, and no other period");
  const auto open_link = [interface, lifted]() -> std::unique_ptr<ethercat::Link> {
    // Blocking: a busy wait would take the core from the simulation.
    return std::make_unique<ethercat::LockStepLink>(
        std::make_unique<ethercat::RawSocketLink>(interface, ethercat::RawSocketLink::Wait::kBlock), lifted);
  };
  return hal::make_ethercat_robot(open_link, options, clock, period);
}

}  // namespace

OpenedRobot open_robot(const RobotOptions& options, const hal::Clock& clock,
                       std::chrono::nanoseconds period) {
  check_robot(options);
  OpenedRobot opened;
  hal::EthercatOptions ethercat = options.ethercat;
  const sim::BaseParameters simulation = with_youbot_wheels(options.simulation);
  if (options.name == "loopback" && options.ethercat.kind == hal::YoubotKind::kBaseAndArm) {
    sim::MobileManipulatorParameters parameters;
    parameters.wheels = static_cast<const sim::MecanumWheelParameters&>(simulation);
    parameters.step = simulation.step;
    if (options.arm) build_arm(*options.arm, parameters.masses, parameters.arm);
    opened.manipulator = std::make_shared<sim::MobileManipulator>(parameters, options.scene);
    opened.robot =
        std::make_unique<hal::LoopbackRobot>(*opened.manipulator, clock, period, wheel_and_arm_joints());
  } else if (options.name == "loopback") {
    opened.plant = std::make_unique<sim::Base>(simulation);
    opened.robot = std::make_unique<hal::LoopbackRobot>(*opened.plant, clock, period, wheel_joints());
    opened.truth = &opened.plant->pose();
  } else if (options.name == "wire") {
    sim::bus::YoubotBusOptions emulation;
    emulation.robot = options.ethercat.kind;
    emulation.base = simulation;
    emulation.coupled = emulation.robot == drivers::tmcl::YoubotKind::kBaseAndArm;
    emulation.scene = options.scene;
    if (options.arm) build_arm(*options.arm, emulation.masses, emulation.arm);
    opened.emulation = std::make_shared<sim::bus::YoubotBus>(emulation);
    opened.manipulator = {opened.emulation, opened.emulation->manipulator()};
    opened.capture = make_capture(options.name);
    ethercat.tap = opened.capture.get();
    opened.robot = std::make_unique<WireRobot>(*opened.emulation, ethercat, clock, period);
    if (opened.emulation->has_base()) opened.truth = &opened.emulation->pose();
  } else if (names_interface(options.name, kEthercatPrefix)) {
    const std::string interface = options.name.substr(kEthercatPrefix.size());
    opened.capture = make_capture(interface);
    ethercat.tap = opened.capture.get();
    opened.robot = clock.is_real()
                       ? hal::make_ethercat_robot(interface, ethercat, clock, period)
                       : lock_step_robot(interface, ethercat, !simulation.on_ground, clock, period);
  } else {
    opened.robot = hal::make_can_robot(options.name.substr(kCanPrefix.size()), options.can, clock, period);
  }
  // When lifted, the simulated body does not move; the wheels give more information.
  if (!simulation.on_ground) opened.truth = nullptr;
  return opened;
}

bool is_robot_name(const std::string& name) {
  return name == "loopback" || name == "wire" || names_interface(name, kEthercatPrefix) ||
         names_interface(name, kCanPrefix);
}

void check_robot_name(const std::string& name) {
  if (name == kEthercatPrefix || name == kCanPrefix)
    throw std::invalid_argument("--robot: '" + name + "' lacks its network interface; 'ip link' lists them");
  if (!is_robot_name(name))
    throw std::invalid_argument(
        "--robot: there is no '" + name +
        "'; known: loopback, wire, ethercat:IFACE, and, for one joint on a bench, can:IFACE");
}

void check_robot(const RobotOptions& options) {
  check_robot_name(options.name);
  if (options.arm && !is_simulated(options.name))
    throw std::invalid_argument(
        "'simulation.robot_file' is for the robots loopback and wire, and the robot is '" + options.name +
        "': remove the key, or choose another robot; youbot-sim takes the file by --robot-file");
}

bool is_simulated(const std::string& name) {
  return !name.starts_with(kEthercatPrefix) && !name.starts_with(kCanPrefix);
}

void check_virtual_time(const std::string& name) {
  if (name.starts_with(kCanPrefix))
    throw std::invalid_argument("--virtual-time: " + name + " lives in real time");
}

}  // namespace runtime
