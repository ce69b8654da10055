/// @file
/// One run from its robot's activation to its summary, without a service.
#pragma once
#include <atomic>
#include <chrono>
#include <functional>
#include <optional>

#include "hal/clock.h"
#include "operation/config.h"
#include "operation/run.h"
#include "runtime/open_robot.h"

namespace operation {

struct AloneOptions : RunOptions {
  std::optional<std::chrono::nanoseconds>
      duration{};  ///< of robot time; empty: until it is finished or stopped
  bool allow_non_real_time = false;
};

/// Blocks until the run is finished, `options.duration` is over, `stop` is true or `is_done()`, which is
/// called once per cycle, as a part of it. `whole`: expected duration, for the progress display.
/// @throws hal::SetupError if real-time was refused and is not waived.
void run_alone(
    hal::Clock& clock, const Config& config, const AloneOptions& options, const runtime::OpenedRobot& robot,
    Run& run, std::optional<std::chrono::nanoseconds> whole, const std::atomic<bool>& stop,
    const std::function<bool()>& is_done = [] { return false; });

}  // namespace operation
