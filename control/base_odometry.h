/// @file
/// Odometry of the base from its wheels alone.
#pragma once
#include "control/link_map.h"
#include "control/planar.h"

namespace control {

/// Integrates wheel increments along the arc of constant twist between two samples. This is exact if the
/// ratios of the wheel speeds are constant; the official driver rotates each increment by the new yaw, an
/// error of half a step. Wheel slip and the chosen wheel radius go straight into the result. Cycle: step().
class BaseOdometry {
 public:
  explicit BaseOdometry(const LinkMap& map) : map_(map) {}

  /// The first step after a reset only stores the wheel positions.
  void reset(const PlanarPose& X_WB = {}) noexcept;
  const PlanarPose& step(const WheelVector& wheel_position_rad) noexcept;
  const PlanarPose& pose() const noexcept { return X_WB_; }

 private:
  LinkMap map_;
  PlanarPose X_WB_;
  WheelVector last_position_rad_ = WheelVector::Zero();
  bool started_ = false;
};

}  // namespace control
