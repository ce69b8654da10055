/// @file
/// Where the base is, from its wheels alone.
#pragma once
#include "control/link_map.h"
#include "control/planar.h"

namespace control {

/// Integrates wheel increments along the arc of constant twist between two samples, which is exact when the
/// wheels keep their ratio (the official driver rotates each increment by the new yaw, off by half a step).
/// Wheel slip and the choice of wheel radius go straight into the result. Cycle: step().
class BaseOdometry {
 public:
  explicit BaseOdometry(const LinkMap& map) : map_(map) {}

  /// The first step after a reset only takes the wheels' positions as the start.
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
