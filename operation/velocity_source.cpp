#include "operation/velocity_source.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace operation {
namespace {

using control::PlanarPose;
using control::PlanarVector;

/// Limits translation (along and across together) and rotation (by itself) to these lengths.
PlanarVector cut(const PlanarVector& v, double linear, double turning) noexcept {
  const double length = v.head<2>().norm();
  PlanarVector result = v;
  if (length > linear) result.head<2>() *= linear / length;
  result[2] = std::clamp(v[2], -turning, turning);
  return result;
}

}  // namespace

PlanarVector VelocitySource::slow_enough_for_wheels(const PlanarVector& twist_B) const noexcept {
  const double fastest_rad_per_s = wheels_.map.wheel_velocity(twist_B).cwiseAbs().maxCoeff();
  if (fastest_rad_per_s <= wheels_.speed_limit_rad_per_s) return twist_B;
  return twist_B * (wheels_.speed_limit_rad_per_s / fastest_rad_per_s);
}

PlanarVector VelocitySource::braked_before_walls(const PlanarVector& twist_B) const noexcept {
  PlanarVector twist_W = control::rotated(twist_B, reference_W_.yaw_rad);
  const Eigen::Vector2d p_W_m(reference_W_.x_m, reference_W_.y_m);
  // v² = 2·a·s along each axis.
  const auto fastest = [this](double way_m) {
    return std::sqrt(2 * limits_.acceleration_m_per_s2 * std::max(0.0, way_m));
  };
  bool cut_short = false;
  for (Eigen::Index i = 0; i < 2; ++i) {
    const double allowed =
        std::clamp(twist_W[i], -fastest(p_W_m[i] - box_W_m_.min()[i]), fastest(box_W_m_.max()[i] - p_W_m[i]));
    cut_short = cut_short || allowed != twist_W[i];
    twist_W[i] = allowed;
  }
  return cut_short ? control::rotated(twist_W, -reference_W_.yaw_rad) : twist_B;
}

void VelocitySource::begin(std::chrono::nanoseconds now, const PlanarPose& X_WB) noexcept {
  last_read_ = now;
  twist_B_.setZero();
  reference_W_ = X_WB;
}

Motion VelocitySource::read(std::chrono::nanoseconds now, const PlanarPose& X_WB) noexcept {
  if (commanded_.take(wanted_B_))
    wanted_B_ = slow_enough_for_wheels(cut(wanted_B_, limits_.speed_m_per_s, limits_.turn_speed_rad_per_s));
  const PlanarVector step = cut(wanted_B_ - twist_B_, limits_.acceleration_m_per_s2 * period_s_,
                                limits_.turn_acceleration_rad_per_s2 * period_s_);
  // Speed and turn rate change independently: between two twists they may add up.
  const PlanarVector next_B = slow_enough_for_wheels(twist_B_ + step);
  const PlanarVector before_B = std::exchange(twist_B_, braked_before_walls(next_B));
  // Also over a pause: a base that moved on meanwhile must not be pulled back.
  const std::chrono::duration<double> elapsed = now - std::exchange(last_read_, now);
  const PlanarPose ahead_W = control::moved_by(reference_W_, twist_B_ * elapsed.count());
  const PlanarVector from_base(ahead_W.x_m - X_WB.x_m, ahead_W.y_m - X_WB.y_m,
                               ahead_W.yaw_rad - X_WB.yaw_rad);
  const PlanarVector leashed = cut(from_base, leash_.m, leash_.rad);
  const Eigen::Vector2d free_W_m(X_WB.x_m + leashed[0], X_WB.y_m + leashed[1]);
  const Eigen::Vector2d held_W_m = control::held_in(box_W_m_, free_W_m);
  reference_W_ = {held_W_m.x(), held_W_m.y(), X_WB.yaw_rad + leashed[2]};
  const bool at_wall = held_W_m != free_W_m || twist_B_ != next_B;
  return {.stamp = now,
          .reference = {reference_W_, control::rotated(twist_B_, reference_W_.yaw_rad),
                        control::rotated((twist_B_ - before_B) / period_s_, reference_W_.yaw_rad)},
          .at_wall = at_wall};
}

}  // namespace operation
