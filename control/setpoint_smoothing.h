/// @file
/// Moves a set-point to its target in small steps (thesis 3.4.2).
#pragma once
#include <Eigen/Geometry>
#include <optional>

#include "control/setpoint_limiter.h"
#include "control/tip_pose.h"
#include "control/workspace.h"

namespace control {

/// Each cycle makes at most one step of translation, in which the axis with the largest error moves exactly
/// one step and the others proportionally, and one step of rotation along the shorter arc. Errors below a
/// threshold pass unchanged; the effective threshold is large enough that a step cannot overshoot. Defaults:
/// the thesis' 0.25 mm and 0.01 degrees per millisecond, thresholds 0.5 mm and 0.05 degrees. The thesis
/// starts and stops at full speed; here acceleration and jerk are limited, and the set-point stops at the
/// workspace limits.
/// Cycle: reset(), step().
class SetpointSmoothing {
 public:
  struct Config {
    double period_s = 1e-3;
    double speed_m_per_s = 0.25;  ///< of the axis with the largest error
    double threshold_m = 5e-4;
    double turn_speed_rad_per_s = 0.17453;
    double turn_threshold_rad = 8.7266e-4;
    /// Infinite: no limit on either, as in the thesis.
    double acceleration_m_per_s2 = kTipLimits.acceleration;
    double jerk_m_per_s3 = kTipLimits.jerk;
    double turn_acceleration_rad_per_s2 = kTipTurnLimits.acceleration;
    double turn_jerk_rad_per_s3 = kTipTurnLimits.jerk;
    Eigen::AlignedBox3d walls_W_m = Workspace{}.tip_W_m;
    /// For the set-point's own velocity, which is rough because of the steps.
    double velocity_cutoff_Hz = 5.0;
  };

  /// @throws std::invalid_argument naming the value out of range.
  explicit SetpointSmoothing(const Config& config);

  /// At rest at this pose.
  void reset(const Eigen::Vector3d& p_WT_m, const Eigen::Quaterniond& q_WT) noexcept;
  /// One cycle towards this pose.
  const TipSetpoint& step(const Eigen::Vector3d& p_WT_m, const Eigen::Quaterniond& q_WT) noexcept;
  const TipSetpoint& setpoint() const noexcept { return setpoint_; }
  /// The set-point is off its target by more than a threshold.
  bool limited() const noexcept { return limited_; }

 private:
  void move(const Eigen::Vector3d& stepped_W_m, const Eigen::Vector3d& goal_W_m) noexcept;
  void turn(const Eigen::Quaterniond& stepped, const Eigen::Quaterniond& goal) noexcept;

  Config config_;
  std::optional<SetpointLimiter<3>> moving_;
  std::optional<SetpointLimiter<3>> turning_;
  TipPose goal_;  // of the last step
  bool limited_ = false;
  double velocity_share_;  // weight of the newest velocity in the filtered one
  TipSetpoint setpoint_;
};

}  // namespace control
