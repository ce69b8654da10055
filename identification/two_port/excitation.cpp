#include "identification/two_port/excitation.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <random>
#include <stdexcept>
#include <string>

namespace identification::two_port {
namespace {

constexpr int kDraws = 16;

std::vector<std::size_t> odd_log_spaced(const ExcitationShape& shape) {
  std::vector<std::size_t> harmonics;
  const double ratio = shape.highest_Hz / shape.lowest_Hz;
  // Harmonic 2·n + 1, n between these.
  const double lowest = std::max(0.0, std::ceil((shape.lowest_Hz * shape.period_s - 1) / 2 - 1e-6));
  const double highest = std::floor((shape.highest_Hz * shape.period_s - 1) / 2 + 1e-6);
  if (highest < lowest) return harmonics;
  for (std::size_t i = 0; i < shape.lines; ++i) {
    const double share =
        shape.lines == 1 ? 0.0 : static_cast<double>(i) / static_cast<double>(shape.lines - 1);
    const double place = shape.lowest_Hz * std::pow(ratio, share) * shape.period_s;
    const double odd = 2 * std::clamp(std::round((place - 1) / 2), lowest, highest) + 1;
    const auto harmonic = static_cast<std::size_t>(odd);
    if (harmonics.empty() || harmonic > harmonics.back()) harmonics.push_back(harmonic);
  }
  return harmonics;
}

double largest(const std::vector<double>& signal) {
  double peak = 0.0;
  for (const double value : signal) peak = std::max(peak, std::abs(value));
  return peak;
}

}  // namespace

Excitation::Excitation(const ExcitationShape& shape, double sample_s, std::uint64_t realization) {
  const auto positive = [](const char* name, double value) {
    if (!std::isfinite(value) || value <= 0.0)
      throw std::invalid_argument(std::string("excitation: ") + name + " is " + std::to_string(value) +
                                  ", must be finite and positive");
  };
  positive("period_s", shape.period_s);
  positive("sample time [s]", sample_s);
  positive("lowest_Hz", shape.lowest_Hz);
  positive("highest_Hz", shape.highest_Hz);
  positive("lines", static_cast<double>(shape.lines));
  positive("peak_N", shape.peak_N);
  const double per_period = shape.period_s / sample_s;
  const auto samples = static_cast<std::size_t>(std::llround(per_period));
  if (std::abs(per_period - std::round(per_period)) > 1e-6 * per_period)
    throw std::invalid_argument("excitation: period_s is " + std::to_string(per_period) +
                                " samples, must be a whole number of them");
  harmonics_ = odd_log_spaced(shape);
  if (harmonics_.empty())
    throw std::invalid_argument(
        "excitation: no odd multiple of 1/period_s lies between lowest_Hz and highest_Hz");
  if (10 * harmonics_.back() > samples)
    throw std::invalid_argument("excitation: highest_Hz is more than a tenth of the sampling rate");

  std::vector<double> cosine(samples);
  for (std::size_t n = 0; n < samples; ++n)
    cosine[n] = std::cos(2 * std::numbers::pi * static_cast<double>(n) / static_cast<double>(samples));
  std::mt19937_64 random(realization);
  std::vector<double> drawn_N(samples);
  double lowest_peak = std::numeric_limits<double>::infinity();
  for (int draw = 0; draw < kDraws; ++draw) {
    std::fill(drawn_N.begin(), drawn_N.end(), 0.0);
    for (const std::size_t harmonic : harmonics_) {
      std::size_t at = random() % samples;  // the phase
      for (double& value : drawn_N) {
        value += cosine[at];
        at += harmonic;
        if (at >= samples) at -= samples;
      }
    }
    const double peak = largest(drawn_N);
    if (peak >= lowest_peak) continue;
    lowest_peak = peak;
    table_N_ = drawn_N;
  }
  double squares = 0.0;
  for (double& value : table_N_) {
    value *= shape.peak_N / lowest_peak;
    squares += value * value;
  }
  crest_factor_ = shape.peak_N / std::sqrt(squares / static_cast<double>(samples));
}

}  // namespace identification::two_port
