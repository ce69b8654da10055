/// @file
/// Limits speed, acceleration and jerk of the base's reference.
#pragma once
#include "control/base_path.h"
#include "control/setpoint_limiter.h"

namespace control {

/// Between the planner and the controller. A reference within the limits passes unchanged. Cycle: all but
/// construction.
class ReferenceLimiter {
 public:
  struct Config {
    SetpointLimits linear = kBaseLimits;
    SetpointLimits turning = kBaseTurnLimits;
  };

  /// @throws std::invalid_argument for a limit that is not finite and positive.
  explicit ReferenceLimiter(const Config& config) : place_(config.linear), yaw_(config.turning) {}

  /// At rest at this pose.
  void reset(const PlanarPose& X_WB) noexcept {
    place_.reset({X_WB.x_m, X_WB.y_m});
    yaw_.reset(Yaw::Constant(X_WB.yaw_rad));
  }

  /// `elapsed_s` since the last step, in a loop of `period_s`.
  BaseReference step(const BaseReference& wanted, double elapsed_s, double period_s) noexcept {
    BaseReference reference = wanted;
    const Eigen::Vector2d& p_W_m = place_.step({wanted.X_WB.x_m, wanted.X_WB.y_m}, elapsed_s, period_s);
    if (place_.limited()) {
      reference.X_WB.x_m = p_W_m.x();
      reference.X_WB.y_m = p_W_m.y();
      reference.twist_W.head<2>() = place_.velocity();
      reference.acceleration_W.head<2>() = place_.acceleration();
    }
    const Yaw& yaw_rad = yaw_.step(Yaw::Constant(wanted.X_WB.yaw_rad), elapsed_s, period_s);
    if (yaw_.limited()) {
      reference.X_WB.yaw_rad = yaw_rad[0];
      reference.twist_W[2] = yaw_.velocity()[0];
      reference.acceleration_W[2] = yaw_.acceleration()[0];
    }
    return reference;
  }
  bool limited() const noexcept { return place_.limited() || yaw_.limited(); }  ///< in the last step

 private:
  using Yaw = SetpointLimiter<1>::Vector;
  SetpointLimiter<2> place_;
  SetpointLimiter<1> yaw_;
};

}  // namespace control
