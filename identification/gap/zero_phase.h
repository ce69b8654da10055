/// @file
/// A low-pass without delay, for recorded data.
#pragma once
#include <cstddef>
#include <span>
#include <vector>

namespace identification::gap {

/// Butterworth low-pass of second order, run forwards and backwards: magnitude of fourth order, no phase. The
/// ends are extended by their mirror image through the end point, so that a constant and a ramp pass
/// unchanged. `cutoff_Hz`: −3 dB frequency of one pass; must be below half the sample rate.
std::vector<double> zero_phase(std::span<const double> samples, double period_s, double cutoff_Hz);

/// zero_phase() twice: steep enough to keep only every n-th sample, even of a second derivative, which
/// amplifies frequencies above the cutoff.
std::vector<double> steep_zero_phase(std::span<const double> samples, double period_s, double cutoff_Hz);

/// Extended by `margin` at each end: the mirror image through the end point, then its last value. `samples`
/// must not be empty.
std::vector<double> with_mirrored_ends(std::span<const double> samples, std::size_t margin);

/// Central differences; one-sided at the ends.
std::vector<double> derivative(std::span<const double> samples, double period_s);

}  // namespace identification::gap
