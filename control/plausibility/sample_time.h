/// @file
/// When a sample was taken, as far as that is known.
#pragma once
#include <algorithm>
#include <chrono>

#include "hal/robot.h"

namespace control {

inline constexpr double kRegularSample_s = std::chrono::duration<double>(hal::kLongestRegularSample).count();
/// After a longer pause nothing before it is compared with anything after it.
inline constexpr double kComparable_s = std::chrono::duration<double>(hal::kLongestCheckedSample).count();

/// So much of what is unsure about a sample's time is in the checks' own constants.
inline constexpr double kAllowed_s = 0.001;

struct SampleTime {
  double elapsed_s = 0.0;  ///< from the stamp of the last sample to that of this one
  /// Largest distance of the true time from the stamp. A check raises no alarm that any time within explains.
  double bounds_s = 0.0;

  /// What exceeds the millisecond that the checks' constants allow. Zero on a quick bus.
  double unsure_s() const noexcept { return std::max(0.0, bounds_s - kAllowed_s); }
};

}  // namespace control
