/// @file
/// The operator's station of a teleoperation: from opening the haptic device until the program is stopped.
#pragma once
#include <atomic>
#include <chrono>
#include <optional>
#include <string>
#include <vector>

#include "drivers/station/traffic.h"
#include "operation/config.h"
#include "runtime/loop.h"

namespace operation {

struct StationOptions {
  std::optional<std::chrono::nanoseconds> duration{};  ///< empty: until it is stopped
  bool allow_non_real_time = false;
};

struct StationSummary {
  std::string device;
  drivers::station::LinkReport link{};  ///< at the end
  runtime::LoopStatistics loop{};
  std::string fault{};  ///< of the haptic device, that ended it; otherwise empty
};

/// Blocks until `stop` is true, the duration is over, or the haptic device fails so that it must be reopened.
/// Logs when the robot's station is found or lost, and the quality of the link every ten seconds.
/// @throws hal::SetupError or drivers::SetupError if device, key or network cannot be used, or real-time was
/// refused and is not waived; std::invalid_argument for an invalid configuration.
StationSummary run_operator_station(const Config& config, const StationOptions& options,
                                    const std::atomic<bool>& stop);

/// For people.
std::string report(const StationSummary& summary);

}  // namespace operation
