#include "identification/experiments/multisine.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <stdexcept>
#include <string>

namespace identification::experiments {
namespace {

constexpr double kTwoPi = 2 * std::numbers::pi;
constexpr int kImprovements = 200;
/// Samples per period of the highest harmonic during the optimisation of the phases.
constexpr std::size_t kOversampling = 8;

/// Σ cos(2π·k·t + φ_k) for the harmonics from `first` on, at the samples of one period.
class Harmonics {
 public:
  Harmonics(std::size_t first, std::size_t samples) : first_(first), cosine_(samples), sine_(samples) {
    for (std::size_t n = 0; n < samples; ++n) {
      const double angle = kTwoPi * static_cast<double>(n) / static_cast<double>(samples);
      cosine_[n] = std::cos(angle);
      sine_[n] = std::sin(angle);
    }
  }

  std::vector<double> sum(const std::vector<double>& phases) const {
    std::vector<double> sum(cosine_.size(), 0.0);
    for (std::size_t i = 0; i < phases.size(); ++i) {
      const double real = std::cos(phases[i]);
      const double imaginary = std::sin(phases[i]);
      for (std::size_t n = 0, at = 0; n < sum.size(); ++n, at = after(at, first_ + i))
        sum[n] += real * cosine_[at] - imaginary * sine_[at];
    }
    return sum;
  }

  std::vector<double> phases(std::size_t count, const std::vector<double>& signal) const {
    std::vector<double> phases(count);
    for (std::size_t i = 0; i < count; ++i) {
      double real = 0.0;
      double imaginary = 0.0;
      for (std::size_t n = 0, at = 0; n < signal.size(); ++n, at = after(at, first_ + i)) {
        real += signal[n] * cosine_[at];
        imaginary -= signal[n] * sine_[at];
      }
      phases[i] = std::atan2(imaginary, real);
    }
    return phases;
  }

 private:
  /// Index `step` samples later in the period. `step` is less than a period: a subtraction is enough, and a
  /// division would take most of the time.
  std::size_t after(std::size_t at, std::size_t step) const noexcept {
    at += step;
    return at < cosine_.size() ? at : at - cosine_.size();
  }

  std::size_t first_;
  std::vector<double> cosine_;
  std::vector<double> sine_;
};

double largest(const std::vector<double>& signal) {
  double peak = 0.0;
  for (const double value : signal) peak = std::max(peak, std::abs(value));
  return peak;
}

std::vector<double> low_crest_phases(std::size_t first, std::size_t count) {
  if (count == 1) return {-std::numbers::pi / 2};
  std::vector<double> phases(count);
  for (std::size_t i = 0; i < count; ++i)
    phases[i] =
        -static_cast<double>(i) * static_cast<double>(i + 1) * std::numbers::pi / static_cast<double>(count);
  const Harmonics harmonics(first, kOversampling * (first + count));
  std::vector<double> best = phases;
  double lowest_peak = largest(harmonics.sum(phases));
  for (int n = 0; n < kImprovements; ++n) {
    std::vector<double> signal = harmonics.sum(phases);
    const double peak = largest(signal);
    if (peak < lowest_peak) {
      lowest_peak = peak;
      best = phases;
    }
    // Hard at first, to leave the initial neighbourhood, softer later.
    const double clip = peak * (0.75 + 0.2 * n / kImprovements);
    for (double& value : signal) value = std::clamp(value, -clip, clip);
    phases = harmonics.phases(count, signal);
  }
  return best;
}

}  // namespace

Multisine::Multisine(const MultisineShape& shape, double period_s) : sample_s_(period_s) {
  const auto samples = static_cast<std::size_t>(std::lround(shape.period_s / period_s));
  const auto first = static_cast<std::size_t>(std::ceil(shape.lowest_Hz * shape.period_s - 1e-6));
  const auto last = static_cast<std::size_t>(std::floor(shape.highest_Hz * shape.period_s + 1e-6));
  if (first < 1 || last < first)
    throw std::invalid_argument("no harmonic of 1/period lies between lowest_Hz and highest_Hz");
  if (10 * last > samples) throw std::invalid_argument("highest_Hz is more than a tenth of the cycle rate");
  harmonics_ = last - first + 1;
  table_ = Harmonics(first, samples).sum(low_crest_phases(first, harmonics_));
  const double peak = largest(table_);
  double squares = 0.0;
  for (double& value : table_) {
    value *= shape.peak / peak;
    squares += value * value;
  }
  crest_factor_ = shape.peak / std::sqrt(squares / static_cast<double>(samples));
}

double Multisine::value(double time_s) const noexcept {
  return table_[static_cast<std::size_t>(std::llround(time_s / sample_s_)) % table_.size()];
}

}  // namespace identification::experiments
