#include "control/plausibility/velocity_agreement.h"

#include <algorithm>
#include <cmath>

namespace control {
namespace {

/// Share of the speed; a factor of 0.5 or 2 makes the difference half of the speed.
constexpr double kSpeedShare = 0.2;
/// Maximum lag of the reported velocity.
constexpr double kVelocityLag_s = 0.02;
constexpr double kRateSmoothing_s = 0.01;
/// Alarm threshold: some counts of quantised readings, and the motion during the timing error of a sample.
constexpr double kAlarm_rad = 0.006;
constexpr double kSampleJitter_s = 0.002;
/// No single sample decides: firmware 1.48 occasionally reports a wrong position.
constexpr double kFewestRates = 6;

}  // namespace

bool VelocityAgreement::update(double position_rad, double velocity_rad_per_s,
                               const SampleTime& time) noexcept {
  const double elapsed_s = time.elapsed_s;
  if (!known_) {
    known_ = true;
    smooth_rate_rad_per_s_ = smooth_velocity_rad_per_s_ = trend_rad_per_s_ = velocity_rad_per_s;
    above_rad_ = below_rad_ = 0.0;
    position_rad_ = position_rad;
    velocity_rad_per_s_ = velocity_rad_per_s;
    return false;
  }
  const double rate = (position_rad - position_rad_) / elapsed_s;
  const double velocity = (velocity_rad_per_s + velocity_rad_per_s_) / 2;
  position_rad_ = position_rad;
  velocity_rad_per_s_ = velocity_rad_per_s;

  const double blend = elapsed_s / (kRateSmoothing_s + elapsed_s);
  smooth_rate_rad_per_s_ += blend * (rate - smooth_rate_rad_per_s_);
  // Smoothed twice, so that the noise of single ticks does not count.
  const double trend_step = blend * (smooth_rate_rad_per_s_ - trend_rad_per_s_);
  trend_rad_per_s_ += trend_step;
  smooth_velocity_rad_per_s_ += blend * (velocity - smooth_velocity_rad_per_s_);
  const double speed = std::max(std::abs(smooth_rate_rad_per_s_), std::abs(smooth_velocity_rad_per_s_));

  const double alarm_rad = kAlarm_rad + kSampleJitter_s * speed;
  const double slack_rad =
      (kSpeedShare * speed + bias_rad_per_s_) * elapsed_s + kVelocityLag_s * std::abs(trend_step);
  const double difference_rad = (velocity - rate) * elapsed_s;
  const double unsure_rad = time.unsure_s() * speed;
  const double most_rad = (alarm_rad + 2 * unsure_rad) / kFewestRates;
  above_rad_ = std::max(-unsure_rad, above_rad_ + std::min(difference_rad - slack_rad, most_rad));
  below_rad_ = std::max(-unsure_rad, below_rad_ + std::min(-difference_rad - slack_rad, most_rad));
  return std::max(above_rad_, below_rad_) - unsure_rad > alarm_rad;
}

}  // namespace control
