/// @file
/// Time that has passed for a robot from one of its samples to the next.
#pragma once
#include <chrono>

#include "control/speed_proof.h"
#include "hal/robot.h"
#include "hal/seconds.h"

namespace runtime {

inline control::SampleBounds bounds_of(const hal::RobotSample& sample) noexcept {
  return {hal::seconds(sample.earliest), hal::seconds(sample.latest)};
}

/// Gives a velocity filter its step, so that none of the robot's time is counted twice or left out: if more
/// is counted than has passed, a joint seems slower than it is, and an overspeed goes undetected. One thread.
/// Cycle: all but construction.
class SampleClock {
 public:
  explicit SampleClock(std::chrono::nanoseconds period) noexcept : period_(period) {}

  /// Once per cycle, with the stamp of the newest sample. 0 if it is not new: its time comes with the next
  /// one, both after a pause of the loop and after missing samples.
  double elapsed_s(std::chrono::nanoseconds stamp) noexcept {
    const std::chrono::nanoseconds elapsed = stamp - counted_;
    if (stamp == last_ || elapsed.count() <= 0) return 0;
    last_ = stamp;
    // Within half a period it counts as one period: a late wake-up is not motion of the robot. The error is
    // carried over, and counted as soon as it is larger.
    const bool regular = 2 * std::chrono::abs(elapsed - period_) <= period_;
    const std::chrono::nanoseconds step = regular ? period_ : elapsed;
    counted_ += step;
    return std::chrono::duration<double>(step).count();
  }

 private:
  std::chrono::nanoseconds period_;
  std::chrono::nanoseconds last_{};
  std::chrono::nanoseconds counted_{};  // time covered by the filter so far
};

}  // namespace runtime
