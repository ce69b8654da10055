/// @file
/// The daemon as a service: robot and master stay open with the drives off, and a commander on the control
/// socket says when they are to work.
#pragma once
#include <atomic>
#include <filesystem>
#include <functional>
#include <map>
#include <optional>
#include <string>

#include "apps/youbotd/config.h"

namespace youbotd {

struct ServiceOptions {
  std::filesystem::path control_socket;
  std::filesystem::path config_file;
  /// Each run records into a new directory run-1, run-2, … in it.
  std::optional<std::filesystem::path> record_directory{};
  bool allow_non_real_time = false;
  /// The configuration with these settings over it, as `youbotctl set` makes them.
  std::function<Config(const std::map<std::string, std::string>& settings)> configuration;
};

/// Runs until `stop` becomes true, then brings the robot to rest. Blocks. What happens goes to the log, with
/// what of the robot is lost, and what is back.
///
/// - One peer commands at a time: who enables does until the drives are off, and the robot comes to rest when
///   his connection ends or is silent for loop.commander_timeout_s. Anybody who may connect may stop.
/// - A fault ends the run, not the service. Nothing moves again before somebody enables.
/// - Nothing waits for the log: when its reader hangs, lines are lost and counted.
/// Requests, all answered by the status: status, alive, enable, stop, disable, mode NAME, set KEY VALUE,
/// unset KEY, set velocity X Y YAW.
/// @throws hal::SetupError when robot, master or socket cannot be opened, or real-time was refused and is not
///         waived; std::invalid_argument for a configuration no part accepts.
void run_service(const ServiceOptions& options, const std::atomic<bool>& stop);

}  // namespace youbotd
