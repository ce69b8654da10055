#include "control/setpoint_smoothing.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <stdexcept>
#include <string>

#include "control/positive.h"

namespace control {
SetpointSmoothing::SetpointSmoothing(const Config& config) : config_(config) {
  const RequirePositive require_positive{"set-point smoothing"};
  require_positive(config.period_s, "period_s");
  require_positive(config.velocity_cutoff_Hz, "velocity_cutoff_Hz");
  require_positive(config.speed_m_per_s, "speed_m_per_s");
  require_positive(config.turn_speed_rad_per_s, "turn_speed_rad_per_s");
  // Of an error along the diagonal the axis that is furthest off has 1/√3.
  config_.threshold_m = std::max(require_positive(config.threshold_m, "threshold_m"),
                                 std::numbers::sqrt3 * config.speed_m_per_s * config.period_s);
  config_.turn_threshold_rad = std::max(require_positive(config.turn_threshold_rad, "turn_threshold_rad"),
                                        config.turn_speed_rad_per_s * config.period_s);
  velocity_share_ = 1 - std::exp(-2 * std::numbers::pi * config.velocity_cutoff_Hz * config.period_s);
}

void SetpointSmoothing::reset(const Eigen::Vector3d& p_WT_m, const Eigen::Quaterniond& q_WT) noexcept {
  setpoint_ = {{p_WT_m, q_WT.normalized()}, Eigen::Vector3d::Zero()};
}

const TipSetpoint& SetpointSmoothing::step(const Eigen::Vector3d& p_WT_m,
                                           const Eigen::Quaterniond& q_WT) noexcept {
  const Eigen::Vector3d before_m = setpoint_.p_WT_m;
  const Eigen::Vector3d error_m = p_WT_m - before_m;
  const double furthest_m = error_m.cwiseAbs().maxCoeff();
  const double step_m = config_.speed_m_per_s * config_.period_s;
  setpoint_.p_WT_m = error_m.norm() > config_.threshold_m
                         ? Eigen::Vector3d(before_m + step_m / furthest_m * error_m)
                         : p_WT_m;

  const double angle_rad = setpoint_.q_WT.angularDistance(q_WT);
  setpoint_.q_WT =
      angle_rad > config_.turn_threshold_rad
          ? setpoint_.q_WT.slerp(config_.turn_speed_rad_per_s * config_.period_s / angle_rad, q_WT)
                .normalized()
          : q_WT.normalized();

  const Eigen::Vector3d velocity_m_per_s = (setpoint_.p_WT_m - before_m) / config_.period_s;
  setpoint_.v_WT_W_m_per_s += velocity_share_ * (velocity_m_per_s - setpoint_.v_WT_W_m_per_s);
  return setpoint_;
}

}  // namespace control
