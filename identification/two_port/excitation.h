/// @file
/// A force of many sines with which to measure a two-port: log-spaced frequencies, periodic, random phases.
#pragma once
#include <cstddef>
#include <cstdint>
#include <vector>

namespace identification::two_port {

struct ExcitationShape {
  double period_s = 10.0;
  double lowest_Hz = 0.3;
  double highest_Hz = 40.0;
  std::size_t lines = 40;  ///< wished for; fewer where the grid of 1/period is coarser than they
  double peak_N = 1.0;     ///< largest magnitude within a period
};

/// Sines of equal amplitude at odd multiples of 1/period, near where log-spaced frequencies are: what even
/// distortion makes of them falls beside the lines. Once everything has settled, whole periods have no
/// leakage.
///
/// Each realization has other phases, the best of several draws from its seed. Friction and other distortion
/// repeat with the period like a true answer, but not with the phases: only over several realizations does
/// the coherence tell of it (R. Pintelon, J. Schoukens, System Identification, 2nd ed. 2012, chapter 4).
class Excitation {
 public:
  /// `sample_s`: how far apart value() tells them, held in between.
  /// @throws std::invalid_argument when the period is not a whole number of samples, the peak or lines are
  /// not positive, no line lies in the band, or one above a tenth of the sampling rate.
  Excitation(const ExcitationShape& shape, double sample_s, std::uint64_t realization);

  /// Cycle: of the periodic continuation.
  double force_N(std::size_t sample) const noexcept { return table_N_[sample % table_N_.size()]; }
  std::size_t samples_per_period() const noexcept { return table_N_.size(); }
  /// Multiples of 1/period that are in it, rising; the same in every realization.
  const std::vector<std::size_t>& harmonics() const noexcept { return harmonics_; }
  /// Peak over rms.
  double crest_factor() const noexcept { return crest_factor_; }

 private:
  std::vector<std::size_t> harmonics_;
  std::vector<double> table_N_;  // one period
  double crest_factor_ = 0.0;
};

}  // namespace identification::two_port
