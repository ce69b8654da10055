#include "control/haptic_mapping.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <stdexcept>
#include <string>

#include "control/master_frame.h"
#include "control/positive.h"

namespace control {
namespace {

/// Minimum time at rest of a rate-only device before it drives anything.
constexpr double kRest_s = 0.2;

/// Position between `rest` and `full`, 0 to 1.
double share(double value, double rest, double full) noexcept {
  return std::clamp((value - rest) / (full - rest), 0.0, 1.0);
}

}  // namespace

HapticMapping::HapticMapping(const Config& config) : config_(config) {
  const RequirePositive require_positive{"haptic mapping"};
  require_positive(config.period_s, "period_s");
  require_positive(config.motion_scale, "motion_scale");
  require_positive(config.rate_speed_m_per_s, "rate_speed_m_per_s");
  require_positive(config.rate_turn_rad_per_s, "rate_turn_rad_per_s");
  require_positive(config.leash_m, "leash_m");
  // From half a turn on, the shorter arc is the other way round.
  if (require_positive(config.turn_leash_rad, "turn_leash_rad") >= std::numbers::pi)
    throw std::invalid_argument("haptic mapping: turn_leash_rad = " + std::to_string(config.turn_leash_rad) +
                                " must be less than half a turn");
  for (const double half_axis_m : config.boundary.half_axes_m) require_positive(half_axis_m, "half axis");
  if (!(config.full_deflection_m > config.rest_deflection_m && config.rest_deflection_m >= 0 &&
        config.full_turn_rad > config.rest_turn_rad && config.rest_turn_rad >= 0))
    throw std::invalid_argument(
        "haptic mapping: full_deflection_m = " + std::to_string(config.full_deflection_m) +
        " and full_turn_rad = " + std::to_string(config.full_turn_rad) +
        " must be more than those at rest, and these not negative");
  if (!(config.boundary.rim_N_per_m >= 0))
    throw std::invalid_argument("haptic mapping: rim_N_per_m = " +
                                std::to_string(config.boundary.rim_N_per_m) + " must not be negative");
  if (!config.boundary.inside(Eigen::Vector3d::Zero()))
    throw std::invalid_argument("haptic mapping: the handle's origin must be inside the rate boundary");
}

void HapticMapping::index(const Grip& grip, const TipPose& target) noexcept {
  target_ = target;
  mode_ = Mode::kPosition;
  at_rest_s_ = 0;
  been_inside_ = !config_.rate_only && config_.boundary.inside(grip.p_HD_m);
  offset_W_m_ = target.p_WT_m - config_.motion_scale * turned_H_W(grip.p_HD_m);
  q_HD_index_ = grip.q_HD;
  q_WT_index_ = target.q_WT;
}

void HapticMapping::set_motion_scale(double scale, const Grip& grip) noexcept {
  if (scale == config_.motion_scale) return;
  offset_W_m_ += (config_.motion_scale - scale) * turned_H_W(grip.p_HD_m);
  config_.motion_scale = scale;
}

const TipPose& HapticMapping::step(const Grip& grip, const TipPose& tip, bool may_drive,
                                   bool fresh) noexcept {
  if (config_.rate_only) {
    follow_deflection(grip, tip, may_drive, fresh);
    return target_;
  }
  const Eigen::Vector3d hand_W_m = config_.motion_scale * turned_H_W(grip.p_HD_m);
  if (!config_.boundary.inside(grip.p_HD_m)) {
    mode_ = Mode::kRate;
    if (may_drive && been_inside_) advance(config_.rate_speed_m_per_s * hand_W_m.normalized(), tip.p_WT_m);
  } else {
    // The thesis accumulates old drift and both displacements, from a handle position one cycle later than
    // the target; without that cycle the result is this.
    if (mode_ == Mode::kRate) offset_W_m_ = target_.p_WT_m - hand_W_m;
    mode_ = Mode::kPosition;
    been_inside_ = true;
    target_.p_WT_m = hand_W_m + offset_W_m_;
  }
  if (config_.follow_rotation)
    target_.q_WT = (turned_H_W(grip.q_HD * q_HD_index_.conjugate()) * q_WT_index_).normalized();
  return target_;
}

void HapticMapping::advance(const Eigen::Vector3d& velocity_W_m_per_s,
                            const Eigen::Vector3d& p_WT_m) noexcept {
  const double ahead_m = (target_.p_WT_m - p_WT_m).dot(velocity_W_m_per_s.normalized());
  if (ahead_m < config_.leash_m) target_.p_WT_m += config_.period_s * velocity_W_m_per_s;
}

void HapticMapping::turn(const Eigen::Vector3d& velocity_W_rad_per_s,
                         const Eigen::Quaterniond& q_WT) noexcept {
  const Eigen::Vector3d axis_W = velocity_W_rad_per_s.normalized();
  if (rotation_between(q_WT, target_.q_WT).dot(axis_W) >= config_.turn_leash_rad) return;
  const Eigen::AngleAxisd step(config_.period_s * velocity_W_rad_per_s.norm(), axis_W);
  target_.q_WT = (step * target_.q_WT).normalized();
}

void HapticMapping::follow_deflection(const Grip& grip, const TipPose& tip, bool may_drive,
                                      bool fresh) noexcept {
  const double deflection_m = grip.p_HD_m.norm();
  const double pace = share(deflection_m, config_.rest_deflection_m, config_.full_deflection_m);
  const Eigen::Vector3d turn_H_rad = rotation_between(Eigen::Quaterniond::Identity(), grip.q_HD);
  const double turn_rad = turn_H_rad.norm();
  const double turn_pace =
      config_.follow_rotation ? share(turn_rad, config_.rest_turn_rad, config_.full_turn_rad) : 0.0;
  at_rest_s_ = fresh && pace <= 0 && turn_pace <= 0 ? at_rest_s_ + config_.period_s : 0.0;
  been_inside_ = been_inside_ || at_rest_s_ >= kRest_s;
  const bool driving = may_drive && been_inside_;
  mode_ = driving && pace > 0 ? Mode::kRate : Mode::kPosition;
  if (!driving) return;
  if (pace > 0)
    advance(pace * config_.rate_speed_m_per_s / deflection_m * turned_H_W(grip.p_HD_m), tip.p_WT_m);
  if (turn_pace > 0)
    turn(turn_pace * config_.rate_turn_rad_per_s / turn_rad * turned_H_W(turn_H_rad), tip.q_WT);
}

}  // namespace control
