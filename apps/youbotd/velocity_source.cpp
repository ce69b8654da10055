#include "apps/youbotd/velocity_source.h"

#include <algorithm>
#include <utility>

namespace youbotd {
namespace {

using control::PlanarPose;
using control::PlanarVector;

/// Shortened, along and across together and turning by itself, to these lengths.
PlanarVector cut(const PlanarVector& v, double linear, double turning) noexcept {
  const double length = v.head<2>().norm();
  PlanarVector result = v;
  if (length > linear) result.head<2>() *= linear / length;
  result[2] = std::clamp(v[2], -turning, turning);
  return result;
}

}  // namespace

void VelocitySource::begin(std::chrono::nanoseconds now) noexcept {
  last_read_ = now;
  twist_B_.setZero();
  reference_W_ = {};
}

Motion VelocitySource::read(std::chrono::nanoseconds now, const PlanarPose& X_WB) noexcept {
  if (told_.take(wanted_B_)) wanted_B_ = cut(wanted_B_, limits_.speed_m_per_s, limits_.turn_speed_rad_per_s);
  const PlanarVector step = cut(wanted_B_ - twist_B_, limits_.acceleration_m_per_s2 * period_s_,
                                limits_.turn_acceleration_rad_per_s2 * period_s_);
  twist_B_ += step;
  // Over a pause, too: a base that went on meanwhile is not to be pulled back.
  const std::chrono::duration<double> elapsed = now - std::exchange(last_read_, now);
  const PlanarPose ahead_W = control::moved_by(reference_W_, twist_B_ * elapsed.count());
  const PlanarVector from_base(ahead_W.x_m - X_WB.x_m, ahead_W.y_m - X_WB.y_m,
                               ahead_W.yaw_rad - X_WB.yaw_rad);
  const PlanarVector leashed = cut(from_base, kLeash_m, kLeash_rad);
  reference_W_ = {X_WB.x_m + leashed[0], X_WB.y_m + leashed[1], X_WB.yaw_rad + leashed[2]};
  return {now,
          {reference_W_, control::rotated(twist_B_, reference_W_.yaw_rad),
           control::rotated(step / period_s_, reference_W_.yaw_rad)}};
}

}  // namespace youbotd
