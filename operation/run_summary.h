/// @file
/// Summary common to all runs of the daemon.
#pragma once
#include <chrono>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "control/plausibility/checks.h"
#include "operation/cycle_record.h"
#include "runtime/loop.h"

namespace operation {

struct RunSummary {
  std::string robot;
  bool virtual_time = false;
  std::vector<std::string> not_real_time;  ///< refused by the system
  runtime::LoopStatistics loop;
  control::ChecksOff once_silent_checks;  ///< of the sensors: those that did not run for a while
  std::uint64_t cycles_setpoint_limited = 0;
  std::uint64_t cycles_torque_rate_limited = 0;
  std::uint64_t cycles_at_wall = 0;      ///< at a workspace limit
  bool cut_short = false;                ///< stopped on request or by the duration, before it was finished
  std::string stop_reason;               ///< empty if there was no fault
  std::chrono::nanoseconds stop_time{};  ///< of the fault, as in the recording
  std::optional<std::filesystem::path> fault_report;
  std::filesystem::path record_directory;  ///< empty: not recorded
  bool recorded = false;
  std::uint64_t cycles_recorded = 0;
  std::uint64_t cycles_lost = 0;
  std::vector<std::string> recording_problems;
  std::vector<std::string> robot_report;  ///< see hal::Robot::report()
};

/// `limited` as in the record of a cycle.
inline void count_limiters(std::uint8_t limited, RunSummary& summary) noexcept {
  if ((limited & limiter::kSetpoint) != 0) ++summary.cycles_setpoint_limited;
  if ((limited & limiter::kTorqueRate) != 0) ++summary.cycles_torque_rate_limited;
  if ((limited & limiter::kWorkspace) != 0) ++summary.cycles_at_wall;
}

/// Closes a recording and takes its results.
template <typename Recording>
void finish(Recording& recording, RunSummary& summary) {
  recording.close();
  summary.recorded = true;
  summary.cycles_recorded = recording.cycles_recorded();
  summary.cycles_lost = recording.cycles_lost();
  summary.recording_problems = recording.problems();
}

}  // namespace operation
