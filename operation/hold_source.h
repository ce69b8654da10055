/// @file
/// The mode `hold`: the base holds its position.
#pragma once
#include "operation/motion_source.h"

namespace operation {

/// A push against the base meets the controller's stiffness; beyond the following error limit the base is
/// stopped. Ends only by a stop.
class HoldSource final : public MotionSource {
 public:
  void begin(std::chrono::nanoseconds /*now*/, const control::PlanarPose& X_WB) noexcept override {
    X_WB_ = X_WB;
  }
  Motion read(std::chrono::nanoseconds now, const control::PlanarPose& /*X_WB*/) noexcept override {
    return {.stamp = now, .reference = {.X_WB = X_WB_}};
  }

 private:
  control::PlanarPose X_WB_;
};

}  // namespace operation
