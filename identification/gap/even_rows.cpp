#include "identification/gap/even_rows.h"

#include <algorithm>
#include <cmath>

#include "identification/fit/quantile.h"

namespace identification::gap {
namespace {

/// Times within this share of a period count as even.
constexpr double kEven = 0.02;
/// Times of even samples that were written late: nine of ten are this close to even steps, in periods. Steps
/// that truly vary add up to more, and so does a rate that changes.
constexpr double kLatePeriods = 3;
constexpr double kMostTimes = 0.9;

std::vector<double> away_from_even(std::span<const double> time_s, double period_s) {
  std::vector<double> away;
  away.reserve(time_s.size());
  for (std::size_t i = 0; i < time_s.size(); ++i)
    away.push_back(std::abs(time_s[i] - time_s.front() - static_cast<double>(i) * period_s));
  return away;
}

bool is_smoother_at_even_steps(std::span<const double> time_s, std::span<const double> motion) {
  double at_times = 0;
  double at_even = 0;
  for (std::size_t i = 1; i + 1 < motion.size(); ++i) {
    const double share = (time_s[i] - time_s[i - 1]) / (time_s[i + 1] - time_s[i - 1]);
    const double rise = motion[i + 1] - motion[i - 1];
    // Relative to the noise that the difference has from that of each sample, least at a share of a half.
    const double noise = 1 + share * share + (1 - share) * (1 - share);
    at_times += std::pow(motion[i] - motion[i - 1] - share * rise, 2) / noise;
    at_even += std::pow(motion[i] - motion[i - 1] - 0.5 * rise, 2) / 1.5;
  }
  return at_even < at_times;
}

/// "position_rad", "velocity_rad_per_s"; null without motion.
const char* motion_of(const Recording& recording) {
  for (const char* name : {"position_rad", "velocity_rad_per_s"})
    if (recording.has(name)) return name;
  return nullptr;
}

}  // namespace

std::vector<double> interpolated(std::span<const double> time_s, std::span<const double> values,
                                 double period_s, std::size_t count, Between between) {
  const std::size_t last = values.size() - 1;
  const auto secant = [&](std::size_t i) {
    return (values[i + 1] - values[i]) / (time_s[i + 1] - time_s[i]);
  };
  const auto slope = [&](std::size_t i) {
    if (i == 0) return secant(0);
    if (i == last) return secant(last - 1);
    const double before = time_s[i] - time_s[i - 1];
    const double after = time_s[i + 1] - time_s[i];
    return (secant(i - 1) * after + secant(i) * before) / (before + after);
  };
  std::vector<double> result;
  result.reserve(count);
  std::size_t next = 1;
  for (std::size_t k = 0; k < count; ++k) {
    const double t = time_s.front() + static_cast<double>(k) * period_s;
    while (next < last && time_s[next] < t) ++next;
    const double step = time_s[next] - time_s[next - 1];
    const double x = std::clamp((t - time_s[next - 1]) / step, 0.0, 1.0);
    const double line = values[next - 1] + x * (values[next] - values[next - 1]);
    const double rise = values[next] - values[next - 1];
    const double bend =
        between == Between::kLine
            ? 0
            : x * (1 - x) * ((1 - x) * (step * slope(next - 1) - rise) - x * (step * slope(next) - rise));
    result.push_back(line + bend);
  }
  return result;
}

EvenRows::EvenRows(const Source& source) {
  const auto time_s = source.recording.column("time_s");
  sampled_at_s_.assign(time_s.begin(), time_s.end());
  period_s_ =
      (time_s.back() - time_s.front()) / static_cast<double>(std::max<std::size_t>(2, time_s.size()) - 1);
  std::vector<double> away = away_from_even(time_s, period_s_);
  even_ = std::ranges::max(away) <= kEven * period_s_;
  const char* const motion = motion_of(source.recording);
  if (even_ || motion == nullptr || fit::quantile(std::move(away), kMostTimes) > kLatePeriods * period_s_ ||
      !is_smoother_at_even_steps(time_s, source.recording.column(motion)))
    return;
  even_ = true;
  for (std::size_t i = 0; i < sampled_at_s_.size(); ++i)
    sampled_at_s_[i] = time_s.front() + static_cast<double>(i) * period_s_;
}

std::size_t EvenRows::next_to(std::size_t sample) const {
  const double since_s = sampled_at_s_[sample] - sampled_at_s_.front();
  return std::min(sampled_at_s_.size() - 1, static_cast<std::size_t>(std::llround(since_s / period_s_)));
}

std::vector<double> EvenRows::of(std::span<const double> values, Between between) const {
  if (even_) return {values.begin(), values.end()};
  return interpolated(sampled_at_s_, values, period_s_, values.size(), between);
}

}  // namespace identification::gap
