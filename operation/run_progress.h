/// @file
/// Progress of a run on the terminal.
#pragma once
#include <chrono>
#include <optional>
#include <thread>

#include "hal/newest_value.h"
#include "operation/run.h"

namespace operation {

/// Writes to standard error from its own thread: create it before the loop's thread becomes a real-time one.
/// Ends with this object.
class RunProgress {
 public:
  /// Prints nothing unless `shown`. `whole`: expected duration of the run; empty if unknown.
  /// @throws hal::SetupError if the thread cannot be created.
  RunProgress(bool shown, std::optional<std::chrono::nanoseconds> whole);

  /// Cycle: wait-free, one thread.
  void publish(const Progress& progress) noexcept { newest_.publish(progress); }

 private:
  void show(const std::stop_token& ended, std::optional<std::chrono::nanoseconds> whole);

  hal::NewestValue<Progress> newest_;
  std::jthread thread_;  // last: it uses the others
};

}  // namespace operation
