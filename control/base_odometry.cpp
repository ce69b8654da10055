#include "control/base_odometry.h"

namespace control {

void BaseOdometry::reset(const PlanarPose& X_WB) noexcept {
  X_WB_ = X_WB;
  started_ = false;
}

const PlanarPose& BaseOdometry::step(const WheelVector& wheel_position_rad) noexcept {
  if (started_) X_WB_ = moved_by(X_WB_, map_.twist(wheel_position_rad - last_position_rad_));
  last_position_rad_ = wheel_position_rad;
  started_ = true;
  return X_WB_;
}

}  // namespace control
