/// @file
/// The daemon's configuration: defaults in the structs it is made of, a TOML file over them.
#pragma once
#include <chrono>
#include <filesystem>
#include <map>
#include <optional>
#include <string>

#include "control/base_path.h"
#include "control/teleoperation.h"
#include "operation/base_task.h"
#include "runtime/open_haptic.h"
#include "runtime/open_robot.h"
#include "runtime/program/control_socket.h"
#include "runtime/real_time.h"

namespace operation {

struct Config {
  runtime::RobotOptions robot;
  runtime::RealTimeConfig real_time;
  /// A robot whose commander says nothing for longer comes to rest.
  std::chrono::nanoseconds commander_timeout = runtime::kCommanderTimeout;
  Cycle::Config cycle;
  control::BasePath::Plan path;
  runtime::HapticOptions haptic;
  /// Only with a master; what it says of the base is in `cycle`.
  control::Teleoperation::Config teleoperation;
  /// The configuration holds [teleoperation]: it is a master's hand that moves the robot.
  bool teleoperated = false;
};

/// Of the wheels' speed limit, which references may ask for: who overshoots them a little is no fault.
inline constexpr double kWheelSpeedShare = 0.95;

/// Where a path from its start leaves the box first, sampled; nowhere: it stays inside. Setup.
std::optional<control::PlanarPose> first_outside(const control::BasePath::Plan& plan,
                                                 const Eigen::AlignedBox2d& base_W_m);

/// Every key is optional; apps/youbotd/demo.toml and teleop.toml show them all.
/// `settings`, keys with their tables and values as TOML has them, stand over what the file says. They come
/// from outside: none makes the machine stronger, faster or later to stop than the file
/// (setting_bounds.h), and none names a file outside its folder.
/// @throws runtime::ConfigError listing all problems, each with file and line.
Config load_config(const std::filesystem::path& file,
                   const std::map<std::string, std::string>& settings = {});

}  // namespace operation
