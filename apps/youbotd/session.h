/// @file
/// One run of the daemon, from opening the robot to the summary.
#pragma once
#include <atomic>
#include <chrono>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "apps/youbotd/config.h"
#include "apps/youbotd/path_metrics.h"
#include "apps/youbotd/run_summary.h"

namespace youbotd {

struct SessionOptions {
  std::filesystem::path config_file;
  std::optional<std::chrono::nanoseconds> duration{};  ///< of robot time; none: until the motion is finished
  std::optional<std::filesystem::path> record_directory{};
  bool virtual_time = false;
  bool allow_non_real_time = false;
  /// Sees every cycle, as a part of it: outside virtual time it must neither allocate nor block.
  std::function<void(const CycleRecord&)> after_cycle{};
};

struct Summary : RunSummary {
  PathMetrics path;
};

/// @throws std::invalid_argument when recording there would replace something.
void check_record_directory(const std::filesystem::path& directory);

/// Runs until the motion is finished, the duration is over, `stop` becomes true or a fault. Blocks.
/// @throws hal::SetupError when the robot cannot be opened, or real-time was refused and is not waived;
///         std::invalid_argument for a configuration no part accepts.
Summary run_session(const Config& config, const SessionOptions& options, const std::atomic<bool>& stop);

}  // namespace youbotd
