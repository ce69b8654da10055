/// @file
/// A low-pass that shifts nothing in time, for data that is already recorded.
#pragma once
#include <span>
#include <vector>

namespace sim::gap {

/// Butterworth low-pass of second order, run forwards and backwards: the magnitude of the fourth order, no
/// phase. Ends are extended by their mirror image through the end point, so that a constant and a ramp pass
/// unchanged. `cutoff_Hz`: where one of the two passes is at −3 dB; must be below half the sample rate.
std::vector<double> zero_phase(std::span<const double> samples, double period_s, double cutoff_Hz);

/// Central differences; one-sided at the ends.
std::vector<double> derivative(std::span<const double> samples, double period_s);

}  // namespace sim::gap
