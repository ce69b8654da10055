/// @file
/// A multisine force to measure a two-port: log-spaced frequencies, periodic, random phases.
#pragma once
#include <cstddef>
#include <cstdint>
#include <vector>

namespace identification::two_port {

struct ExcitationShape {
  double period_s = 10.0;
  double lowest_Hz = 0.3;
  double highest_Hz = 40.0;
  std::size_t lines = 40;  ///< requested number; fewer if the grid of 1/period is coarser
  double peak_N = 1.0;     ///< largest magnitude within a period
};

/// Sines of equal amplitude at odd multiples of 1/period, close to log-spaced frequencies: even distortion
/// falls between the lines. In steady state, whole periods have no leakage.
///
/// Each realization has other phases, the best of several draws from its seed. Friction and other distortion
/// repeat with the period like a true response, but not with the phases: the coherence shows them only over
/// several realizations (R. Pintelon, J. Schoukens, System Identification, 2nd ed. 2012, chapter 4).
class Excitation {
 public:
  /// `sample_s`: interval of value(), held in between.
  /// @throws std::invalid_argument if the period is not a whole number of samples, the peak or lines are not
  /// positive, no line lies in the band, or one lies above a tenth of the sampling rate.
  Excitation(const ExcitationShape& shape, double sample_s, std::uint64_t realization);

  /// Cycle: value of the periodic continuation.
  double force_N(std::size_t sample) const noexcept { return table_N_[sample % table_N_.size()]; }
  std::size_t samples_per_period() const noexcept { return table_N_.size(); }
  /// The multiples of 1/period in it, ascending; the same in every realization.
  const std::vector<std::size_t>& harmonics() const noexcept { return harmonics_; }
  /// Peak over rms.
  double crest_factor() const noexcept { return crest_factor_; }

 private:
  std::vector<std::size_t> harmonics_;
  std::vector<double> table_N_;  // one period
  double crest_factor_ = 0.0;
};

}  // namespace identification::two_port
