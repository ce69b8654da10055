/// @file
/// One run of the daemon, from opening the robot to the summary.
#pragma once
#include <atomic>
#include <functional>

#include "operation/base_run.h"
#include "operation/config.h"
#include "operation/run_alone.h"

namespace operation {

struct SessionOptions : AloneOptions {
  /// Called in every cycle, as a part of it: outside virtual time it must neither allocate nor block.
  std::function<void(const CycleRecord&)> after_cycle{};
};

/// Blocks until the motion is finished, the duration is over, `stop` becomes true or a fault.
/// @throws hal::SetupError if the robot cannot be opened, or real-time was refused and is not waived;
/// std::invalid_argument for an invalid configuration.
Summary run_session(const Config& config, const SessionOptions& options, const std::atomic<bool>& stop);

}  // namespace operation
