/// @file
/// Creates the robot for `--robot NAME`.
#pragma once
#include <chrono>
#include <memory>
#include <optional>
#include <string>
#include <string_view>

#include "control/planar.h"
#include "drivers/ethercat/pcap_ring.h"
#include "hal/can_robot.h"
#include "hal/clock.h"
#include "hal/ethercat_robot.h"
#include "hal/robot.h"
#include "runtime/configuration/arm_model.h"
#include "sim/base.h"
#include "sim/bus/youbot_bus.h"
#include "sim/environment.h"
#include "sim/mobile_manipulator.h"

namespace runtime {

struct RobotOptions {
  std::string name = "loopback";
  hal::EthercatOptions ethercat{.kind = hal::YoubotKind::kBase};
  hal::CanOptions can;
  /// For loopback and wire. A simulation in lock-step only reads whether its wheels are on the ground; a real
  /// robot ignores it.
  sim::BaseParameters simulation;
  /// The model that the simulated arm of loopback and wire follows; empty: sim::built_robot().
  std::optional<ArmModel> arm{};
  sim::EnvironmentParameters scene;  ///< objects that the end effector of a simulated arm on a base can touch
};

struct OpenedRobot {
  // Parts of a simulated robot, in order of construction.
  std::unique_ptr<sim::Base> plant;
  std::shared_ptr<sim::bus::YoubotBus> emulation;
  std::shared_ptr<sim::MobileManipulator> manipulator;   ///< base and arm; with `wire` it belongs to the
                                                         ///< emulation
  std::unique_ptr<drivers::ethercat::PcapRing> capture;  ///< the last frames on the bus; null without a bus
  std::unique_ptr<hal::Robot> robot;
  /// True pose of the simulated base, but not of a loopback with an arm; also null if its wheels are lifted.
  const control::PlanarPose* truth = nullptr;
};

/// Prefixes of robot names on an interface.
inline constexpr std::string_view kEthercatPrefix = "ethercat:";
inline constexpr std::string_view kCanPrefix = "can:";

/// - `loopback`: the simulated base behind the HAL; with an arm if `ethercat.kind` is base+arm.
/// - `wire`: the same behind emulated motor controllers, through the complete EtherCAT stack. Its arm has no
///   known zero: `ethercat.home_arms`.
/// - `ethercat:IFACE`: a robot, or youbot-sim, on a network interface.
/// - `can:IFACE`: one joint on a bench, on a CAN interface.
/// `clock` must outlive the result. @throws std::invalid_argument as check_robot() does.
OpenedRobot open_robot(const RobotOptions& options, const hal::Clock& clock, std::chrono::nanoseconds period);

bool is_robot_name(const std::string& name);
/// @throws std::invalid_argument for an unknown name, listing the known ones.
void check_robot_name(const std::string& name);
/// @throws std::invalid_argument as check_robot_name() does, and for options that do not fit the name.
void check_robot(const RobotOptions& options);
/// Whether it is simulated in this process.
bool is_simulated(const std::string& name);
/// @throws std::invalid_argument if such a robot cannot run in virtual time. On a bus it can if it is a
/// simulation in lock-step, which is checked at activation.
void check_virtual_time(const std::string& name);

}  // namespace runtime
