/// @file
/// How much time has passed for a robot from one of its samples to the next.
#pragma once
#include <chrono>

#include "control/speed_proof.h"
#include "hal/robot.h"
#include "hal/seconds.h"

namespace runtime {

inline control::SampleBounds bounds_of(const hal::RobotSample& sample) noexcept {
  return {hal::seconds(sample.earliest), hal::seconds(sample.latest)};
}

/// Tells a velocity filter by how much to step, so that none of the robot's time is counted twice or left
/// out: where more is counted than has passed, a joint looks slower than it is, and no overspeed is seen. One
/// thread. Cycle: all but construction.
class SampleClock {
 public:
  explicit SampleClock(std::chrono::nanoseconds period) noexcept : period_(period) {}

  /// Once a cycle, with the stamp of the newest sample. 0 when that is no new one: its time comes with the
  /// next, after a pause of the loop as after samples that did not come.
  double elapsed_s(std::chrono::nanoseconds stamp) noexcept {
    const std::chrono::nanoseconds elapsed = stamp - counted_;
    if (stamp == last_ || elapsed.count() <= 0) return 0;
    last_ = stamp;
    // Within half a period it is one: a late wake-up is no motion of the robot. What it is off by is not
    // forgotten, and counted as soon as it is more.
    const bool regular = 2 * std::chrono::abs(elapsed - period_) <= period_;
    const std::chrono::nanoseconds step = regular ? period_ : elapsed;
    counted_ += step;
    return std::chrono::duration<double>(step).count();
  }

 private:
  std::chrono::nanoseconds period_;
  std::chrono::nanoseconds last_{};
  std::chrono::nanoseconds counted_{};  // up to here the filter has come
};

}  // namespace runtime
