/// @file
/// One run of teleoperation, from opening robot and haptic device to the summary.
#pragma once
#include <atomic>
#include <functional>
#include <vector>

#include "operation/config.h"
#include "operation/run_alone.h"
#include "operation/teleop_run.h"

namespace operation {

struct TeleopOptions : AloneOptions {
  /// Tasks of a simulated operator on the loopback's handle once the robot obeys it; then the run ends.
  /// Empty: they hold the handle still.
  std::vector<sim::Task> tasks{};
  /// Called in every cycle, as a part of it: outside virtual time it must neither allocate nor block.
  std::function<void(const TeleopRecord&)> after_cycle{};
};

/// Blocks until the tasks are done, the duration is over, `stop` becomes true or a fault.
/// @throws hal::SetupError if robot or haptic device cannot be opened, or real-time was refused and is not
/// waived; std::invalid_argument for an invalid configuration.
TeleopSummary run_teleop_session(const Config& config, const TeleopOptions& options,
                                 const std::atomic<bool>& stop);

}  // namespace operation
