/// @file
/// One run of teleoperation, from opening robot and master to the summary.
#pragma once
#include <atomic>
#include <functional>
#include <vector>

#include "operation/config.h"
#include "operation/run_alone.h"
#include "operation/teleop_run.h"

namespace operation {

struct TeleopOptions : AloneOptions {
  /// What a simulated operator does on the loopback's pen once the robot obeys it; then the run ends. Empty:
  /// he holds the pen still.
  std::vector<sim::Task> tasks{};
  /// Sees every cycle, as a part of it: outside virtual time it must neither allocate nor block.
  std::function<void(const TeleopRecord&)> after_cycle{};
};

/// Runs until the tasks are done, the duration is over, `stop` becomes true or a fault. Blocks.
/// @throws hal::SetupError when robot or master cannot be opened, or real-time was refused and is not waived;
///         std::invalid_argument for a configuration no part accepts.
TeleopSummary run_teleop_session(const Config& config, const TeleopOptions& options,
                                 const std::atomic<bool>& stop);

}  // namespace operation
