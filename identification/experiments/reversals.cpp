#include "identification/experiments/reversals.h"

#include <cmath>
#include <cstddef>
#include <stdexcept>

namespace identification::experiments {
namespace {

/// 0 → 1 → −1 → 0 over one period.
double triangle(double periods) noexcept {
  const double place = periods + 0.25 - std::floor(periods + 0.25);
  return 1 - 4 * std::abs(place - 0.5);
}

}  // namespace

Reversals::Reversals(const ReversalsConfig& config) : config_(checked(config)) {
  // Rounding may put the last height slightly below the lowest.
  for (double height = config_.highest_rad_per_s; height >= config_.lowest_rad_per_s * (1 - 1e-9);
       height /= config_.shrink)
    heights_rad_per_s_.push_back(height);
  if (heights_rad_per_s_.empty()) throw std::invalid_argument("lowest_rad_per_s is above highest_rad_per_s");
}

double Reversals::duration_s(int /*measurement*/) const noexcept {
  return config_.period_s * config_.periods * static_cast<double>(heights_rad_per_s_.size());
}

void Reversals::begin(int /*measurement*/, const Reading& /*reading*/) noexcept { finished_ = false; }

SetPoint Reversals::step(const Reading& reading) noexcept {
  const double periods = reading.time_s / config_.period_s;
  const auto height = static_cast<std::size_t>(periods / config_.periods + 1e-9);
  finished_ = finished_ || height >= heights_rad_per_s_.size();
  return {hal::JointCommand::velocity_rad_per_s(finished_ ? 0.0
                                                          : heights_rad_per_s_[height] * triangle(periods))};
}

}  // namespace identification::experiments
