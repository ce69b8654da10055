/// @file
/// The daemon's configuration: defaults in its structs, overridden by a TOML file.
#pragma once
#include <chrono>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "control/base_path.h"
#include "control/teleoperation.h"
#include "operation/arm_file.h"
#include "operation/base_task.h"
#include "runtime/open_haptic.h"
#include "runtime/open_robot.h"
#include "runtime/program/control_socket.h"
#include "runtime/real_time.h"
#include "runtime/recording/recording_file.h"

namespace operation {

/// In Config::opened_once.
inline constexpr const char* kHapticDevice = "haptic.device";

struct Config {
  runtime::Role role = runtime::Role::kBoth;
  runtime::RobotOptions robot;
  runtime::RealTimeConfig real_time;
  /// If the commanding client is silent for longer, the robot comes to rest.
  std::chrono::nanoseconds commander_timeout = runtime::kCommanderTimeout;
  Cycle::Config cycle;
  control::BasePath::Plan path;
  runtime::HapticOptions haptic;
  /// Only with a haptic device; its settings for the base are in `cycle`.
  control::Teleoperation::Config teleoperation;
  /// [teleoperation.arm] robot_file; its model is in `teleoperation`, with what other keys change of it.
  std::optional<ArmFile> arm_file;
  /// [simulation] robot_file; its model is in `robot`.
  std::optional<ArmFile> simulated_arm_file;
  /// Drive models and robot files that the configuration names, as used; robot files with their URDF. Names
  /// are those in the configuration, in normal form.
  std::vector<runtime::RecordingFile::Attachment> models;
  /// The configuration has [teleoperation], or role = "robot": a haptic device commands the robot.
  bool teleoperated = false;
  /// Keys and tables that are read only when robot and haptic device are opened, as written;
  /// "simulation" with the text of its robot file. The rest is read for each run. The key of the haptic
  /// device is apart from its table, kHapticDevice.
  std::map<std::string, std::string> opened_once;
};

/// Share of the wheels' speed limit that references may use: a small overshoot is not a fault.
inline constexpr double kWheelSpeedShare = 0.95;

/// First point at which a sampled path leaves the box; empty: it stays inside. Setup.
std::optional<control::PlanarPose> first_outside(const control::BasePath::Plan& plan,
                                                 const Eigen::AlignedBox2d& base_W_m);

/// Each robot file of the configuration, with the model that control or the simulated arm uses.
std::vector<std::string> arm_lines(const Config& config);

/// Every key is optional; apps/youbotd/demo.toml and teleop.toml show all of them. `settings`, keys with
/// their tables and values in TOML syntax, override the file. They come from outside: none makes the machine
/// stronger, faster or later to stop than the file (setting_bounds.h), and none names a file outside its
/// folder.
/// @throws runtime::ConfigError listing all problems, each with file and line.
Config load_config(const std::filesystem::path& file,
                   const std::map<std::string, std::string>& settings = {});

}  // namespace operation
