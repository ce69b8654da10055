/// @file
/// Source of the cycle's set-points.
#pragma once
#include <chrono>

#include "control/base_path.h"

namespace operation {

struct Motion {
  std::chrono::nanoseconds stamp{};  ///< when the set-point was made; too old stops the robot
  control::BaseReference reference;
  bool finished = false;  ///< the motion is complete: come to rest and switch off
  bool at_wall = false;   ///< held at a workspace limit
};

/// Called by the cycle's thread.
class MotionSource {
 public:
  MotionSource() = default;
  MotionSource(const MotionSource&) = delete;
  MotionSource& operator=(const MotionSource&) = delete;
  virtual ~MotionSource() = default;

  /// Cycle: the robot obeys from now on and is at `X_WB`.
  virtual void begin(std::chrono::nanoseconds now, const control::PlanarPose& X_WB) noexcept = 0;
  /// Cycle: wait-free. `X_WB`: odometry of the base.
  virtual Motion read(std::chrono::nanoseconds now, const control::PlanarPose& X_WB) noexcept = 0;
};

/// Drives a planned path, then rests briefly at its end.
class PathSource final : public MotionSource {
 public:
  /// Time at the goal before the motion counts as finished.
  static constexpr std::chrono::seconds kRestAtGoal{2};

  /// The plan's start must be the position of the base.
  explicit PathSource(const control::BasePath::Plan& plan) : path_(plan) {}

  std::chrono::duration<double> duration() const noexcept {
    return std::chrono::duration<double>(path_.duration_s()) + kRestAtGoal;
  }

  void begin(std::chrono::nanoseconds now, const control::PlanarPose& /*X_WB*/) noexcept override {
    begin_ = now;
  }
  Motion read(std::chrono::nanoseconds now, const control::PlanarPose& /*X_WB*/) noexcept override {
    const std::chrono::duration<double> elapsed = now - begin_;
    return {.stamp = now, .reference = path_.at(elapsed.count()), .finished = elapsed >= duration()};
  }

 private:
  control::BasePath path_;
  std::chrono::nanoseconds begin_{};
};

}  // namespace operation
