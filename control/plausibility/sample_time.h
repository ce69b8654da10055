/// @file
/// Time of a sample, with its uncertainty.
#pragma once
#include <algorithm>
#include <chrono>

#include "hal/robot.h"

namespace control {

inline constexpr double kRegularSample_s = std::chrono::duration<double>(hal::kLongestRegularSample).count();
/// Samples before and after a longer pause are not compared.
inline constexpr double kComparable_s = std::chrono::duration<double>(hal::kLongestCheckedSample).count();

/// Uncertainty of a sample's time that the checks' own constants include.
inline constexpr double kAllowed_s = 0.001;

struct SampleTime {
  double elapsed_s = 0.0;  ///< from the stamp of the last sample to that of this one
  /// Maximum distance of the true time from the stamp. A check raises no alarm if any time within the bounds
  /// explains the data.
  double bounds_s = 0.0;

  /// Uncertainty beyond the millisecond that the checks' constants include. Zero on a fast bus.
  double unsure_s() const noexcept { return std::max(0.0, bounds_s - kAllowed_s); }
};

}  // namespace control
