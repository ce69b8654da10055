#include "identification/experiments/fourier_motion.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

namespace identification::experiments {
namespace {

/// Samples in a period of the highest harmonic: a peak between two of them is higher by at most 0.1 %.
constexpr double kSamplesPerPeriod = 64;

using State = FourierMotion::State;

/// 10·x³ − 15·x⁴ + 6·x⁵ of the time, with its derivatives.
State risen(double time_s, double ramp_s) {
  if (time_s >= ramp_s) return {1, 0, 0};
  const double x = time_s / ramp_s;
  return {x * x * x * (10 + x * (6 * x - 15)), 30 * x * x * (x - 1) * (x - 1) / ramp_s,
          60 * x * (x - 1) * (2 * x - 1) / (ramp_s * ramp_s)};
}

State window(const FourierMotion& motion, double time_s) {
  const double left_s = motion.duration_s - time_s;
  if (!(time_s > 0 && left_s > 0)) return {};
  if (time_s <= left_s) return risen(time_s, motion.ramp_s);
  State falling = risen(left_s, motion.ramp_s);
  falling.velocity_rad_per_s = -falling.velocity_rad_per_s;
  return falling;
}

/// How often the joint's amplitude fits into its limits.
double room(const FourierMotion& motion, const MotionLimits& limits, Eigen::Index joint) {
  const auto harmonics = static_cast<double>(motion.sine_rad.cols());
  const double step_s = motion.period_s / (kSamplesPerPeriod * std::max(1.0, harmonics));
  double needed = 0;
  for (double t = step_s; t < motion.duration_s; t += step_s) {
    const State state = motion.at(joint, t);
    const double away_rad = state.position_rad - motion.centre_rad[joint];
    const double free_rad = away_rad > 0 ? limits.upper_rad[joint] - motion.centre_rad[joint]
                                         : motion.centre_rad[joint] - limits.lower_rad[joint];
    if (free_rad <= 0) return 0;
    needed = std::max({needed, std::abs(away_rad) / free_rad,
                       std::abs(state.velocity_rad_per_s) / limits.speed_rad_per_s[joint],
                       std::abs(state.acceleration_rad_per_s2) / limits.acceleration_rad_per_s2[joint]});
  }
  return needed > std::numeric_limits<double>::min() ? 1 / needed : 0;
}

}  // namespace

State FourierMotion::at(Eigen::Index joint, double time_s) const noexcept {
  const State w = window(*this, time_s);
  const double base_rad_per_s = 2 * std::numbers::pi / period_s;
  State sum;
  for (Eigen::Index k = 0; k < sine_rad.cols(); ++k) {
    const double rate = base_rad_per_s * static_cast<double>(k + 1);
    const double s = std::sin(rate * time_s);
    const double c = std::cos(rate * time_s);
    const double value = sine_rad(joint, k) * s + cosine_rad(joint, k) * c;
    sum.position_rad += value;
    sum.velocity_rad_per_s += rate * (sine_rad(joint, k) * c - cosine_rad(joint, k) * s);
    sum.acceleration_rad_per_s2 -= rate * rate * value;
  }
  return {centre_rad[joint] + w.position_rad * sum.position_rad,
          w.velocity_rad_per_s * sum.position_rad + w.position_rad * sum.velocity_rad_per_s,
          w.acceleration_rad_per_s2 * sum.position_rad + 2 * w.velocity_rad_per_s * sum.velocity_rad_per_s +
              w.position_rad * sum.acceleration_rad_per_s2};
}

FourierMotion filling(FourierMotion motion, const MotionLimits& limits) {
  for (Eigen::Index joint = 0; joint < motion.joints(); ++joint) {
    const double factor = room(motion, limits, joint);
    motion.sine_rad.row(joint) *= factor;
    motion.cosine_rad.row(joint) *= factor;
  }
  return motion;
}

}  // namespace identification::experiments
