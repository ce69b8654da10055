/// @file
/// Turns `--robot NAME` into a robot.
#pragma once
#include <chrono>
#include <memory>
#include <string>
#include <string_view>

#include "control/planar.h"
#include "drivers/ethercat/pcap_ring.h"
#include "hal/can_robot.h"
#include "hal/clock.h"
#include "hal/ethercat_robot.h"
#include "hal/robot.h"
#include "sim/base.h"
#include "sim/bus/youbot_bus.h"
#include "sim/environment.h"
#include "sim/mobile_manipulator.h"

namespace runtime {

struct RobotOptions {
  std::string name = "loopback";
  hal::EthercatOptions ethercat{.kind = hal::YoubotKind::kBase};
  hal::CanOptions can;
  /// Of loopback and wire. A simulation in lock-step reads whether its wheels are on the ground; a robot
  /// reads nothing of it.
  sim::BaseParameters simulation;
  sim::EnvironmentParameters scene;  ///< what the tip of a simulated arm on a base touches
};

struct OpenedRobot {
  // What stands behind a simulated robot, in order of construction.
  std::unique_ptr<sim::Base> plant;
  std::shared_ptr<sim::bus::YoubotBus> emulation;
  std::shared_ptr<sim::MobileManipulator> manipulator;   ///< base and arm; with `wire` it is the emulation's
  std::unique_ptr<drivers::ethercat::PcapRing> capture;  ///< the last frames on the bus; null without a bus
  std::unique_ptr<hal::Robot> robot;
  /// True pose of the simulated base, but not of a loopback with an arm; null too when its wheels are off the
  /// ground.
  const control::PlanarPose* truth = nullptr;
};

/// What names of robots on an interface begin with.
inline constexpr std::string_view kEthercatPrefix = "ethercat:";
inline constexpr std::string_view kCanPrefix = "can:";

/// - `loopback`: the simulated base behind the HAL; with an arm on it where `ethercat.kind` is base+arm.
/// - `wire`: the same behind emulated motor controllers, through every byte of the EtherCAT master. Its arm
///   does not know its zero: `ethercat.home_arms`.
/// - `ethercat:IFACE`: a robot, or youbot-sim, on a network interface.
/// - `can:IFACE`: one joint on a bench, on a CAN interface.
/// `clock` outlives the result. @throws std::invalid_argument as check_robot_name() does.
OpenedRobot open_robot(const RobotOptions& options, const hal::Clock& clock, std::chrono::nanoseconds period);

bool is_robot_name(const std::string& name);
/// @throws std::invalid_argument for a name nobody knows, listing those there are.
void check_robot_name(const std::string& name);
/// Whether it is simulated in this process.
bool is_simulated(const std::string& name);
/// @throws std::invalid_argument where such a robot cannot run in virtual time. On a bus it can when it is a
/// simulation in lock-step, of which it is asked when it is activated.
void check_virtual_time(const std::string& name);

}  // namespace runtime
