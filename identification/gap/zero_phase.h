/// @file
/// A low-pass that shifts nothing in time, for data that is already recorded.
#pragma once
#include <cstddef>
#include <span>
#include <vector>

namespace identification::gap {

/// Butterworth low-pass of second order, run forwards and backwards: the magnitude of the fourth order, no
/// phase. Ends are extended by their mirror image through the end point, so that a constant and a ramp pass
/// unchanged. `cutoff_Hz`: where one of the two passes is at −3 dB; must be below half the sample rate.
std::vector<double> zero_phase(std::span<const double> samples, double period_s, double cutoff_Hz);

/// Twice zero_phase(): steep enough that every n-th sample may be kept, also of a second derivative, which
/// raises what lies above the cutoff.
std::vector<double> steep_zero_phase(std::span<const double> samples, double period_s, double cutoff_Hz);

/// With `margin` more at each end: the mirror image through the end point, beyond which the last of it stays.
/// `samples` may not be empty.
std::vector<double> with_mirrored_ends(std::span<const double> samples, std::size_t margin);

/// Central differences; one-sided at the ends.
std::vector<double> derivative(std::span<const double> samples, double period_s);

}  // namespace identification::gap
