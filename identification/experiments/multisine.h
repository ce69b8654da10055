/// @file
/// A sum of sines of equal amplitude with low peaks: maximum power at many frequencies under a torque limit.
#pragma once
#include <cstddef>
#include <vector>

namespace identification::experiments {

struct MultisineShape {
  double period_s = 10.0;
  double lowest_Hz = 0.1;
  double highest_Hz = 10.0;
  double peak = 1.0;  ///< largest magnitude within a period
};

/// Harmonics of 1/period between the two frequencies. Their phases start as Schroeder's, −k·(k−1)·π/K, and
/// are improved by clipping the sum's peaks and keeping the resulting phases (Van der Ouderaa). A single
/// harmonic gives a sine that begins at zero.
class Multisine {
 public:
  /// @throws std::invalid_argument if no harmonic lies in the band, or one lies above a tenth of the sampling
  /// rate, where a held value no longer resembles a sine.
  Multisine(const MultisineShape& shape, double period_s);

  /// Cycle: value of the periodic continuation; `time_s` not negative.
  double value(double time_s) const noexcept;
  /// Peak over rms: 1.41 for a sine, about 1.4 to 1.7 for many.
  double crest_factor() const noexcept { return crest_factor_; }
  std::size_t harmonics() const noexcept { return harmonics_; }

 private:
  double sample_s_;
  std::size_t harmonics_ = 0;
  double crest_factor_ = 0.0;
  std::vector<double> table_;  // one period
};

}  // namespace identification::experiments
