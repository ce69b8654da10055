#include "sim/gap/noise_floor.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <random>
#include <utility>

#include "sim/gap/zero_phase.h"
#include "sim/identify/statistics.h"

namespace sim::gap {
namespace {

/// Rms of what `noise`, sampled like the recording, becomes in a row.
double in_rows(const std::vector<double>& noise, const Signals& s) {
  const std::vector<double> smooth =
      zero_phase(zero_phase(noise, s.raw_period_s, s.filter_Hz), s.raw_period_s, s.band_Hz);
  const auto length =
      static_cast<std::size_t>(std::max(1LL, std::llround(0.5 / (s.band_Hz * s.raw_period_s))));
  // The median of the squares, as a normal distribution would have it, so that a few jumps do not count.
  std::vector<double> means;
  for (std::size_t first = 0; first + length <= smooth.size(); first += length) {
    double sum = 0;
    for (std::size_t i = first; i < first + length; ++i) sum += smooth[i];
    means.push_back(sum / static_cast<double>(length));
  }
  return identify::robust_sigma(std::move(means));
}

std::vector<double> white_noise(std::size_t count, double sigma) {
  std::mt19937_64 random(1);
  std::normal_distribution<double> normal;
  std::vector<double> noise(count);
  std::ranges::generate(noise, [&] { return sigma * normal(random); });
  return noise;
}

}  // namespace

double noise_floor_Nm(const std::vector<Signals>& signals,
                      const std::vector<std::vector<double>>& reported_Nm, const Band& band,
                      double inertia_kg_m2) {
  constexpr std::size_t kSamples = 20000;
  double sensor = in_rows(white_noise(kSamples, band.torque_sigma_Nm), signals.front());
  std::vector<double> reported;
  for (const std::vector<double>& noise : reported_Nm) reported.push_back(in_rows(noise, signals.front()));
  if (!reported.empty()) sensor = std::max(sensor, identify::median(reported));
  const double period_s = signals.front().raw_period_s;
  const std::vector<double> steps = white_noise(kSamples, band.resolution_rad / std::sqrt(12.0));
  const std::vector<double> smooth = zero_phase(steps, period_s, signals.front().filter_Hz);
  const double encoder =
      inertia_kg_m2 * in_rows(derivative(derivative(smooth, period_s), period_s), signals.front());
  return std::hypot(sensor, encoder);
}

}  // namespace sim::gap
