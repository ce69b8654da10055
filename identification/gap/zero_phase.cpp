#include "identification/gap/zero_phase.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <numbers>
#include <stdexcept>

namespace identification::gap {
namespace {

/// Second-order section, transposed direct form II.
struct Section {
  double b0, b1, b2, a1, a2;

  Section(double period_s, double cutoff_Hz) {
    const double k = std::tan(std::numbers::pi * cutoff_Hz * period_s);
    const double norm = 1 / (1 + std::numbers::sqrt2 * k + k * k);
    b0 = k * k * norm;
    b1 = 2 * b0;
    b2 = b0;
    a1 = 2 * (k * k - 1) * norm;
    a2 = (1 - std::numbers::sqrt2 * k + k * k) * norm;
  }

  /// In place, in the direction of the iterators, starting from the steady state of the first sample.
  template <class Iterator>
  void run(Iterator first, Iterator last) const {
    double s1 = *first * (1 - b0);
    double s2 = *first * (b2 - a2);
    for (; first != last; ++first) {
      const double in = *first;
      const double out = b0 * in + s1;
      s1 = b1 * in - a1 * out + s2;
      s2 = b2 * in - a2 * out;
      *first = out;
    }
  }
};

}  // namespace

std::vector<double> zero_phase(std::span<const double> samples, double period_s, double cutoff_Hz) {
  if (!(cutoff_Hz > 0) || cutoff_Hz * period_s >= 0.5)
    throw std::invalid_argument("zero-phase filter: the cutoff must lie below half the sample rate");
  if (samples.size() < 2) return {samples.begin(), samples.end()};
  const auto wanted = static_cast<std::size_t>(std::ceil(1 / (cutoff_Hz * period_s)));
  const std::size_t margin = std::min(wanted, samples.size() - 1);
  std::vector<double> extended = with_mirrored_ends(samples, margin);
  const Section section(period_s, cutoff_Hz);
  section.run(extended.begin(), extended.end());
  section.run(extended.rbegin(), extended.rend());
  const auto first = extended.begin() + static_cast<std::ptrdiff_t>(margin);
  return {first, first + static_cast<std::ptrdiff_t>(samples.size())};
}

std::vector<double> steep_zero_phase(std::span<const double> samples, double period_s, double cutoff_Hz) {
  return zero_phase(zero_phase(samples, period_s, cutoff_Hz), period_s, cutoff_Hz);
}

std::vector<double> with_mirrored_ends(std::span<const double> samples, std::size_t margin) {
  const std::size_t last = samples.size() - 1;
  std::vector<double> extended;
  extended.reserve(samples.size() + 2 * margin);
  for (std::size_t i = margin; i > 0; --i)
    extended.push_back(2 * samples.front() - samples[std::min(i, last)]);
  extended.insert(extended.end(), samples.begin(), samples.end());
  for (std::size_t i = 1; i <= margin; ++i)
    extended.push_back(2 * samples.back() - samples[last - std::min(i, last)]);
  return extended;
}

std::vector<double> derivative(std::span<const double> samples, double period_s) {
  std::vector<double> result(samples.size());
  if (samples.size() < 2) return result;
  const std::size_t last = samples.size() - 1;
  for (std::size_t i = 1; i < last; ++i) result[i] = (samples[i + 1] - samples[i - 1]) / (2 * period_s);
  // Five points if available: three lose 0.3 % at a fiftieth of the sample rate.
  for (std::size_t i = 2; i + 2 <= last; ++i)
    result[i] = (8 * (samples[i + 1] - samples[i - 1]) - (samples[i + 2] - samples[i - 2])) / (12 * period_s);
  result[0] = (samples[1] - samples[0]) / period_s;
  result[last] = (samples[last] - samples[last - 1]) / period_s;
  return result;
}

}  // namespace identification::gap
