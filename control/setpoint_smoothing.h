/// @file
/// Lets a set-point go to where it should be in small steps (thesis 3.4.2).
#pragma once
#include <Eigen/Geometry>
#include <optional>

#include "control/setpoint_limiter.h"
#include "control/tip_pose.h"
#include "control/workspace.h"

namespace control {

/// Each cycle at most one step of translation, such that the axis that is furthest off goes exactly one step
/// and the others their share, and one of rotation, along the shorter arc. What is nearer than a threshold
/// passes; a threshold counts as no less than what keeps a step from leading past its goal. Defaults: the
/// thesis' 0.25 mm and 0.01 degrees a millisecond, thresholds 0.5 mm and 0.05 degrees. The thesis starts and
/// stops at full speed; here acceleration and jerk are limited, and the set-point stops at the walls.
/// Cycle: reset(), step().
class SetpointSmoothing {
 public:
  struct Config {
    double period_s = 1e-3;
    double speed_m_per_s = 0.25;  ///< of the axis that goes furthest
    double threshold_m = 5e-4;
    double turn_speed_rad_per_s = 0.17453;
    double turn_threshold_rad = 8.7266e-4;
    /// Infinite: none of the two, as in the thesis.
    double acceleration_m_per_s2 = kTipLimits.acceleration;
    double jerk_m_per_s3 = kTipLimits.jerk;
    double turn_acceleration_rad_per_s2 = kTipTurnLimits.acceleration;
    double turn_jerk_rad_per_s3 = kTipTurnLimits.jerk;
    Eigen::AlignedBox3d walls_W_m = Workspace{}.tip_W_m;
    /// Of the set-point's own velocity, which the steps make rough.
    double velocity_cutoff_Hz = 5.0;
  };

  /// @throws std::invalid_argument naming the value out of range.
  explicit SetpointSmoothing(const Config& config);

  /// At rest there.
  void reset(const Eigen::Vector3d& p_WT_m, const Eigen::Quaterniond& q_WT) noexcept;
  /// One cycle towards these.
  const TipSetpoint& step(const Eigen::Vector3d& p_WT_m, const Eigen::Quaterniond& q_WT) noexcept;
  const TipSetpoint& setpoint() const noexcept { return setpoint_; }
  /// The set-point is off where it should be by more than a threshold.
  bool limited() const noexcept { return limited_; }

 private:
  void move(const Eigen::Vector3d& stepped_W_m, const Eigen::Vector3d& goal_W_m) noexcept;
  void turn(const Eigen::Quaterniond& stepped, const Eigen::Quaterniond& goal) noexcept;

  Config config_;
  std::optional<SetpointLimiter<3>> moving_;
  std::optional<SetpointLimiter<3>> turning_;
  TipPose goal_;  // of the last step
  bool limited_ = false;
  double velocity_share_;  // of the newest velocity in the filtered one
  TipSetpoint setpoint_;
};

}  // namespace control
