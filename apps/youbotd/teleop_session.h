/// @file
/// One run of teleoperation, from opening robot and master to the summary.
#pragma once
#include <atomic>
#include <chrono>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "apps/youbotd/config.h"
#include "apps/youbotd/run_summary.h"
#include "apps/youbotd/teleop_cycle.h"
#include "sim/simulated_operator.h"

namespace youbotd {

struct TeleopOptions {
  std::filesystem::path config_file;
  std::optional<std::chrono::nanoseconds> duration{};  ///< of robot time; none: until stopped
  std::optional<std::filesystem::path> record_directory{};
  bool virtual_time = false;
  bool allow_non_real_time = false;
  /// What a simulated operator does on the loopback's pen once the robot obeys it; then the run ends. Empty:
  /// he holds the pen still.
  std::vector<sim::Task> tasks{};
  /// Sees every cycle, as a part of it: outside virtual time it must neither allocate nor block.
  std::function<void(const TeleopRecord&)> after_cycle{};
};

struct TaskReport {
  std::string name;
  sim::TaskOutcome outcome;
};

struct TeleopSummary : RunSummary {
  std::string master;
  std::vector<std::string> master_warnings;
  std::vector<std::pair<control::TeleopPhase, std::chrono::nanoseconds>> phases;  ///< when each began
  std::vector<TaskReport> tasks;
  double largest_grip_force_N = 0.0;
  double most_energy_given_J = 0.0;  ///< to the hand, net since the start
  double furthest_base_m = 0.0;
  double largest_tip_error_m = 0.0;  ///< from the set-point, while the hand moved the robot
};

/// Runs until the tasks are done, the duration is over, `stop` becomes true or a fault. Blocks.
/// @throws hal::SetupError when robot or master cannot be opened, or real-time was refused and is not waived;
///         std::invalid_argument for a configuration no part accepts.
TeleopSummary run_teleop_session(const Config& config, const TeleopOptions& options,
                                 const std::atomic<bool>& stop);

}  // namespace youbotd
