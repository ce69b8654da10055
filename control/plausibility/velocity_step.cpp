#include "control/plausibility/velocity_step.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <span>
#include <utility>

namespace control {
namespace {

/// With these values no constant acceleration is a step, whatever its size: as long as a side counts as
/// steady, the velocity changes by less than a step over the side and the gap.
constexpr double kStepShare = 0.25;
constexpr double kSteadyShare = 0.15;
constexpr double kSteadyOfStep = 0.6;
/// Minimum share of a step that accelerations on both sides do not explain.
constexpr double kAtOnceShare = 0.5;
/// Maximum distance of the neighbours from the mean of their side, as a share of the step: the step happens
/// within one sample.
constexpr double kNeighbourShare = 0.25;
/// Effect of a blow on a light wheel for each missing second: 250 rad/s², half of it in the neighbours.
constexpr double kBlow_rad_per_s2 = 500;
constexpr double kAnyRate = std::numeric_limits<double>::infinity();

template <std::size_t N>
void append(std::array<double, N>& values, double value) noexcept {
  std::shift_left(values.begin(), values.end(), 1);
  values.back() = value;
}

double mean_rate(std::span<const double> values) noexcept {
  return std::accumulate(values.begin(), values.end(), 0.0) / static_cast<double>(values.size());
}

/// Value of the line through equidistant values, `ahead` intervals after the last one.
double extrapolated(std::span<const double> values, double ahead) noexcept {
  const auto count = static_cast<double>(values.size());
  const double mean = mean_rate(values);
  double product = 0;
  for (std::size_t i = 0; i < values.size(); ++i)
    product += (static_cast<double>(i) - 0.5 * (count - 1)) * values[i];
  const double slope = 12 * product / (count * (count * count - 1));
  return mean + slope * (0.5 * (count - 1) + ahead);
}

bool steady(std::span<const double> values, double step, double speed) noexcept {
  const auto [low, high] = std::minmax_element(values.begin(), values.end());
  return *high - *low <= kSteadyOfStep * step + kSteadyShare * speed;
}

}  // namespace

double VelocityStep::least_difference_rad_per_s() const noexcept {
  const double bounds_s = *std::max_element(bounds_s_.begin(), bounds_s_.end());
  const auto mean_rates = [&](std::size_t first) {
    double way_rad = 0;
    double duration_s = 0;
    for (std::size_t i = first; i < first + kSide; ++i) {
      way_rad += rates_rad_per_s_[i] * elapsed_s_[i];
      duration_s += elapsed_s_[i];
    }
    const double shortest_s = duration_s - bounds_s;
    if (!(shortest_s > 0)) return std::pair{-kAnyRate, kAnyRate};
    return std::minmax({way_rad / shortest_s, way_rad / (duration_s + bounds_s)});
  };
  const auto [before_low, before_high] = mean_rates(0);
  const auto [after_low, after_high] = mean_rates(kMemory - kSide);
  return std::max({0.0, after_low - before_high, before_low - after_high});
}

double VelocityStep::usual_s() const noexcept {
  const double longest_s = *std::max_element(elapsed_s_.begin(), elapsed_s_.end());
  return std::accumulate(elapsed_s_.begin(), elapsed_s_.end(), -longest_s) / (kMemory - 1);
}

double VelocityStep::missing_s() const noexcept {
  const double longest_s = std::max({elapsed_s_[kSide - 1], elapsed_s_[kSide], elapsed_s_[kSide + 1]});
  return longest_s > kRegularSample_s ? longest_s - usual_s() : 0;
}

bool VelocityStep::update(double position_rad, const SampleTime& time) noexcept {
  if (count_ > 0) {
    append(rates_rad_per_s_, (position_rad - position_rad_) / time.elapsed_s);
    append(elapsed_s_, time.elapsed_s);
  }
  append(bounds_s_, time.bounds_s);
  position_rad_ = position_rad;
  count_ = std::min(count_ + 1, kMemory + 1);
  return full() && (stepped() || jumped());
}

/// The rate of the interval between the sides is that of a jump if neither side shares it.
bool VelocityStep::jumped() const noexcept {
  const std::span<const double> rates(rates_rad_per_s_);
  const auto before = rates.first(kSide);
  const auto after = rates.last(kSide);
  const double mean_before = mean_rate(before);
  const double mean_after = mean_rate(after);
  const double excess = std::abs(rates[kSide] - std::midpoint(mean_before, mean_after));
  const double bounds_s = std::max(*std::max_element(bounds_s_.begin(), bounds_s_.end()), kAllowed_s);
  const double speed = std::max(std::abs(mean_before), std::abs(mean_after));
  const double least_rad = jump_rad_ + speed * bounds_s + kBlow_rad_per_s2 * missing_s() * elapsed_s_[kSide];
  if (!(excess * elapsed_s_[kSide] > least_rad)) return false;
  const auto steady_beside = [&](std::span<const double> side) {
    const auto [low, high] = std::minmax_element(side.begin(), side.end());
    return *high - *low <= kNeighbourShare * excess;
  };
  return steady_beside(before) && steady_beside(after) &&
         std::abs(mean_after - mean_before) <= kNeighbourShare * excess;
}

bool VelocityStep::stepped() const noexcept {
  const std::span<const double> rates(rates_rad_per_s_);
  const auto before = rates.first(kSide);
  const auto after = rates.last(kSide);
  const double mean_before = mean_rate(before);
  const double mean_after = mean_rate(after);
  const double step = std::abs(mean_after - mean_before);
  const double least = step_rad_per_s_ + kStepShare * std::max(std::abs(mean_before), std::abs(mean_after)) +
                       kBlow_rad_per_s2 * missing_s();
  if (!(step > least && least_difference_rad_per_s() > least)) return false;
  // Acceleration separates the means, too; but then the lines through both sides meet, whatever the encoder's
  // resolution does to the bounds below.
  // The lines are extrapolated to the middle of the interval between the sides.
  const double ahead = elapsed_s_[kSide] > kRegularSample_s ? 0.5 + 0.5 * elapsed_s_[kSide] / usual_s() : 1;
  const double at_once =
      std::abs(extrapolated(after, 1 - static_cast<double>(kSide) - ahead) - extrapolated(before, ahead));
  if (!(at_once > kAtOnceShare * least)) return false;
  if (std::abs(before.back() - mean_before) > kNeighbourShare * step ||
      std::abs(after.front() - mean_after) > kNeighbourShare * step)
    return false;
  return steady(before, step_rad_per_s_, std::abs(mean_before)) &&
         steady(after, step_rad_per_s_, std::abs(mean_after));
}

}  // namespace control
