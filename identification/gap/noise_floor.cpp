#include "identification/gap/noise_floor.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <random>
#include <utility>

#include "identification/fit/statistics.h"
#include "identification/gap/zero_phase.h"

namespace identification::gap {
namespace {

/// Standard deviation of a reversal's time, in sample periods, and of how long the joint sticks there:
/// interpolation between two samples is better than either, but not exact.
constexpr double kReversalTiming = 0.1;

/// Rms in a row of `noise`, sampled like the recording.
double in_rows(const std::vector<double>& noise, const Signals& s) {
  const std::vector<double> smooth =
      zero_phase(steep_zero_phase(noise, s.raw_period_s, s.filter_Hz), s.raw_period_s, s.band_Hz);
  const auto length =
      static_cast<std::size_t>(std::max(1LL, std::llround(0.5 / (s.band_Hz * s.raw_period_s))));
  // The median of the squares, scaled for a normal distribution, so that a few jumps do not count.
  std::vector<double> means;
  for (std::size_t first = 0; first + length <= smooth.size(); first += length) {
    double sum = 0;
    for (std::size_t i = first; i < first + length; ++i) sum += smooth[i];
    means.push_back(sum / static_cast<double>(length));
  }
  return fit::robust_sigma(std::move(means));
}

std::vector<double> white_noise(std::size_t count, double sigma) {
  std::mt19937_64 random(1);
  std::normal_distribution<double> normal;
  std::vector<double> noise(count);
  std::ranges::generate(noise, [&] { return sigma * normal(random); });
  return noise;
}

/// Rms of reversals in rows: each reverses the friction, with a timing error of kReversalTiming.
double reversals_Nm(const std::vector<Signals>& signals, const model::effects::DriveModel& base) {
  const auto* coulomb = base.find<model::effects::Coulomb>();
  if (coulomb == nullptr) return 0;
  std::size_t reversals = 0;
  double duration_s = 0;
  for (const Signals& s : signals) {
    for (std::size_t i = 1; i < s.size(); ++i)
      reversals += s.velocity_rad_per_s[i - 1] * s.velocity_rad_per_s[i] < 0 ? 1 : 0;
    duration_s += static_cast<double>(s.size()) * s.period_s;
  }
  const double row_s = 0.5 / signals.front().band_Hz;
  const double each_Nm =
      2 * coulomb->parameters().torque_Nm * kReversalTiming * signals.front().raw_period_s / row_s;
  return each_Nm * std::sqrt(static_cast<double>(reversals) * row_s / duration_s);
}

}  // namespace

double noise_floor_Nm(const std::vector<Signals>& signals,
                      const std::vector<std::vector<double>>& reported_Nm, const Band& band,
                      const model::effects::DriveModel& base) {
  constexpr std::size_t kSamples = 20000;
  double sensor = in_rows(white_noise(kSamples, band.torque_sigma_Nm), signals.front());
  std::vector<double> reported;
  for (const std::vector<double>& noise : reported_Nm) reported.push_back(in_rows(noise, signals.front()));
  if (!reported.empty()) sensor = std::max(sensor, fit::median(reported));
  const double period_s = signals.front().raw_period_s;
  const std::vector<double> steps = white_noise(kSamples, band.resolution_rad / std::sqrt(12.0));
  const std::vector<double> smooth = steep_zero_phase(steps, period_s, signals.front().filter_Hz);
  const double encoder =
      base.inertia_kg_m2 * in_rows(derivative(derivative(smooth, period_s), period_s), signals.front());
  return std::hypot(sensor, encoder, reversals_Nm(signals, base));
}

}  // namespace identification::gap
