/// @file
/// What is told of every run of the daemon, whatever it did.
#pragma once
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "apps/common/loop.h"

namespace youbotd {

struct RunSummary {
  std::string robot;
  bool virtual_time = false;
  std::vector<std::string> not_real_time;  ///< what the system refused
  apps::LoopStatistics loop;
  bool cut_short = false;   ///< stopped on request or by the duration, before it was finished
  std::string stop_reason;  ///< empty when nothing went wrong
  std::optional<std::filesystem::path> fault_report;
  bool recorded = false;
  std::uint64_t cycles_recorded = 0;
  std::uint64_t cycles_lost = 0;
  std::vector<std::string> recording_problems;
  std::vector<std::string> robot_report;  ///< what the robot has to tell, see hal::Robot::report()
};

/// Writes out a recording and takes what it tells.
template <typename Recording>
void finish(Recording& recording, RunSummary& summary) {
  recording.close();
  summary.recorded = true;
  summary.cycles_recorded = recording.cycles_recorded();
  summary.cycles_lost = recording.cycles_lost();
  summary.recording_problems = recording.problems();
}

}  // namespace youbotd
