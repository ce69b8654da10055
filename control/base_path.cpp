#include "control/base_path.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <stdexcept>
#include <string>

#include "control/positive.h"

namespace control {
namespace {

// Peak of the first derivative of 10τ³ − 15τ⁴ + 6τ⁵ on [0, 1].
constexpr double kPeakSpeed = 15.0 / 8.0;

/// Maximum acceleration per distance and 1/duration² along an arc that turns by `turn_rad`: the polynomial's
/// own and, perpendicular to it, the centripetal one, which peak at different times.
double peak_acceleration(double turn_rad) {
  if (turn_rad == 0) return 10.0 / std::numbers::sqrt3;
  constexpr int kSamples = 4096;
  double largest = 0.0;
  for (int i = 0; i <= kSamples / 2; ++i) {  // the second half mirrors the first
    const double tau = static_cast<double>(i) / kSamples;
    const double ds = 30 * tau * tau * (1 - tau) * (1 - tau);
    const double dds = 60 * tau * (1 - tau) * (1 - 2 * tau);
    largest = std::max(largest, std::hypot(dds, turn_rad * ds * ds));
  }
  constexpr double kBetweenSamples = 1 + 1e-6;
  return largest * kBetweenSamples;
}

double shortest_time_s(double distance, double peak_acceleration, double speed, double acceleration) {
  return std::max(kPeakSpeed * distance / speed, std::sqrt(peak_acceleration * distance / acceleration));
}

}  // namespace

BasePath::BasePath(const Plan& plan) : goal_(plan.start) {
  const RequirePositive require_positive{"base path"};
  require_positive(plan.limits.speed_m_per_s, "speed_m_per_s");
  require_positive(plan.limits.acceleration_m_per_s2, "acceleration_m_per_s2");
  require_positive(plan.limits.turn_speed_rad_per_s, "turn_speed_rad_per_s");
  require_positive(plan.limits.turn_acceleration_rad_per_s2, "turn_acceleration_rad_per_s2");
  if (!(std::isfinite(plan.rest_s) && plan.rest_s >= 0))
    throw std::invalid_argument("base path: rest_s must be finite and not negative");
  if (!std::isfinite(plan.start.x_m + plan.start.y_m + plan.start.yaw_rad))
    throw std::invalid_argument("base path: the start must be finite");

  for (const PlanarVector& displacement_B : plan.displacements_B) {
    if (!displacement_B.allFinite() || displacement_B.isZero())
      throw std::invalid_argument("base path: displacement " + std::to_string(segments_.size() + 1) +
                                  " must be finite and not zero");
    const Limits& limits = plan.limits;
    const double duration_s =
        std::max(shortest_time_s(displacement_B.head<2>().norm(), peak_acceleration(displacement_B[2]),
                                 limits.speed_m_per_s, limits.acceleration_m_per_s2),
                 shortest_time_s(std::abs(displacement_B[2]), peak_acceleration(0),
                                 limits.turn_speed_rad_per_s, limits.turn_acceleration_rad_per_s2));
    segments_.push_back({goal_, displacement_B, duration_s_ + plan.rest_s, duration_s});
    duration_s_ += plan.rest_s + duration_s;
    goal_ = moved_by(goal_, displacement_B);
  }
}

BaseReference BasePath::at(double time_s) const noexcept {
  const auto later = std::find_if(segments_.begin(), segments_.end(),
                                  [time_s](const Segment& segment) { return time_s < segment.begin_s; });
  if (later == segments_.begin()) return {segments_.empty() ? goal_ : segments_.front().start};
  const Segment& segment = *(later - 1);
  if (time_s >= segment.begin_s + segment.duration_s)
    return {later == segments_.end() ? goal_ : later->start};

  const double tau = (time_s - segment.begin_s) / segment.duration_s;
  const double s = tau * tau * tau * (10 + tau * (-15 + tau * 6));
  const double ds = 30 * tau * tau * (1 - tau) * (1 - tau) / segment.duration_s;
  const double dds = 60 * tau * (1 - tau) * (1 - 2 * tau) / (segment.duration_s * segment.duration_s);

  BaseReference reference;
  reference.X_WB = moved_by(segment.start, s * segment.displacement_B);
  reference.twist_W = rotated(ds * segment.displacement_B, reference.X_WB.yaw_rad);
  reference.acceleration_W = rotated(dds * segment.displacement_B, reference.X_WB.yaw_rad);
  // The body twist rotates with the base: centripetal acceleration is yaw rate × velocity.
  const double yaw_rate = reference.twist_W[2];
  reference.acceleration_W[0] -= yaw_rate * reference.twist_W[1];
  reference.acceleration_W[1] += yaw_rate * reference.twist_W[0];
  return reference;
}

}  // namespace control
