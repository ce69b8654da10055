#include "control/setpoint_smoothing.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <stdexcept>
#include <string>

#include "control/positive.h"

namespace control {
namespace {

std::optional<SetpointLimiter<3>> limiter(double speed, double acceleration, double jerk) {
  if (std::isinf(acceleration) && std::isinf(jerk)) return std::nullopt;
  return SetpointLimiter<3>({speed, acceleration, jerk});
}

}  // namespace

SetpointSmoothing::SetpointSmoothing(const Config& config) : config_(config) {
  const RequirePositive require_positive{"set-point smoothing"};
  require_positive(config.period_s, "period_s");
  require_positive(config.velocity_cutoff_Hz, "velocity_cutoff_Hz");
  require_positive(config.speed_m_per_s, "speed_m_per_s");
  require_positive(config.turn_speed_rad_per_s, "turn_speed_rad_per_s");
  // For an error along the diagonal, the axis with the largest error has 1/√3 of it.
  config_.threshold_m = std::max(require_positive(config.threshold_m, "threshold_m"),
                                 std::numbers::sqrt3 * config.speed_m_per_s * config.period_s);
  config_.turn_threshold_rad = std::max(require_positive(config.turn_threshold_rad, "turn_threshold_rad"),
                                        config.turn_speed_rad_per_s * config.period_s);
  // No step is longer than the threshold.
  moving_ =
      limiter(config_.threshold_m / config.period_s, config.acceleration_m_per_s2, config.jerk_m_per_s3);
  turning_ = limiter(config_.turn_threshold_rad / config.period_s, config.turn_acceleration_rad_per_s2,
                     config.turn_jerk_rad_per_s3);
  velocity_share_ = 1 - std::exp(-2 * std::numbers::pi * config.velocity_cutoff_Hz * config.period_s);
}

void SetpointSmoothing::reset(const Eigen::Vector3d& p_WT_m, const Eigen::Quaterniond& q_WT) noexcept {
  setpoint_ = {{p_WT_m, q_WT.normalized()}, Eigen::Vector3d::Zero()};
  goal_ = {p_WT_m, q_WT.normalized()};
  limited_ = false;
  if (moving_) moving_->reset();
  if (turning_) turning_->reset();
}

const TipSetpoint& SetpointSmoothing::step(const Eigen::Vector3d& p_WT_m,
                                           const Eigen::Quaterniond& q_WT) noexcept {
  const Eigen::Vector3d before_m = setpoint_.p_WT_m;
  const Eigen::Vector3d error_m = p_WT_m - before_m;
  const double furthest_m = error_m.cwiseAbs().maxCoeff();
  const double step_m = config_.speed_m_per_s * config_.period_s;
  move(error_m.norm() > config_.threshold_m ? Eigen::Vector3d(before_m + step_m / furthest_m * error_m)
                                            : p_WT_m,
       p_WT_m);

  const double angle_rad = setpoint_.q_WT.angularDistance(q_WT);
  turn(angle_rad > config_.turn_threshold_rad
           ? setpoint_.q_WT.slerp(config_.turn_speed_rad_per_s * config_.period_s / angle_rad, q_WT)
           : q_WT,
       q_WT);

  limited_ = (p_WT_m - setpoint_.p_WT_m).norm() > config_.threshold_m ||
             setpoint_.q_WT.angularDistance(q_WT) > config_.turn_threshold_rad;
  goal_ = {p_WT_m, q_WT};
  const Eigen::Vector3d velocity_m_per_s = (setpoint_.p_WT_m - before_m) / config_.period_s;
  setpoint_.v_WT_W_m_per_s += velocity_share_ * (velocity_m_per_s - setpoint_.v_WT_W_m_per_s);
  return setpoint_;
}

void SetpointSmoothing::move(const Eigen::Vector3d& stepped_W_m, const Eigen::Vector3d& goal_W_m) noexcept {
  Eigen::Vector3d& at_W_m = setpoint_.p_WT_m;
  Eigen::Vector3d next_W_m = stepped_W_m;
  if (moving_) {
    const double period_s = config_.period_s;
    const Eigen::Vector3d exact = (stepped_W_m - at_W_m) / period_s;
    const Eigen::Vector3d wanted = moving_->slowed_before(
        config_.walls_W_m, at_W_m,
        moving_->slowed(exact, goal_.p_WT_m - at_W_m, (goal_W_m - goal_.p_WT_m) / period_s, period_s),
        period_s);
    moving_->accelerate(wanted, period_s);
    if (moving_->velocity() != exact) next_W_m = at_W_m + moving_->velocity() * period_s;
  }
  at_W_m = held_in(config_.walls_W_m, next_W_m);
  if (!moving_) return;
  for (Eigen::Index i = 0; i < 3; ++i)
    if (at_W_m[i] != next_W_m[i]) moving_->stop(i);
}

void SetpointSmoothing::turn(const Eigen::Quaterniond& stepped, const Eigen::Quaterniond& goal) noexcept {
  Eigen::Quaterniond& at = setpoint_.q_WT;
  if (!turning_) {
    at = stepped.normalized();
    return;
  }
  const double period_s = config_.period_s;
  const Eigen::Vector3d wanted =
      turning_->slowed(rotation_between(at, stepped) / period_s, rotation_between(at, goal_.q_WT),
                       rotation_between(goal_.q_WT, goal) / period_s, period_s);
  turning_->accelerate(wanted, period_s);
  const Eigen::Vector3d turn_rad = turning_->velocity() * period_s;
  const double angle_rad = turn_rad.norm();
  if (angle_rad > 0) at = (Eigen::AngleAxisd(angle_rad, turn_rad / angle_rad) * at).normalized();
}

}  // namespace control
