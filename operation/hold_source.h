/// @file
/// The mode `hold`: the base stays where it stands.
#pragma once
#include "operation/motion_source.h"

namespace operation {

/// Whoever pushes the base feels the controller's stiffness; further than the following error allows, it is
/// stopped. Ends by a stop.
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
