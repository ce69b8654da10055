/// @file
/// Tells the person at the terminal how far a run is, while it lasts.
#pragma once
#include <chrono>
#include <optional>
#include <thread>

#include "hal/newest_value.h"
#include "operation/run.h"

namespace operation {

/// Writes to standard error from a thread of its own: make it before the loop's thread becomes a real-time
/// one. Ends with this object.
class RunProgress {
 public:
  /// Says nothing when not `shown`. `whole`: how long the run is to last; empty when nobody knows.
  /// @throws hal::SetupError when there is no thread for it.
  RunProgress(bool shown, std::optional<std::chrono::nanoseconds> whole);

  /// Cycle: wait-free, one thread.
  void publish(const Progress& progress) noexcept { newest_.publish(progress); }

 private:
  void show(const std::stop_token& ended, std::optional<std::chrono::nanoseconds> whole);

  hal::NewestValue<Progress> newest_;
  std::jthread thread_;  // last: it uses the others
};

}  // namespace operation
