/// @file
/// When a sample was taken, as far as that is known.
#pragma once
#include <chrono>

#include "hal/robot.h"

namespace control {

inline constexpr double kRegularSample_s = std::chrono::duration<double>(hal::kLongestRegularSample).count();
/// After a longer pause nothing before it is compared with anything after it.
inline constexpr double kComparable_s = std::chrono::duration<double>(hal::kLongestCheckedSample).count();

struct SampleTime {
  double elapsed_s = 0.0;  ///< from the stamp of the last sample to that of this one
  /// Largest distance of the true time from the stamp, less the millisecond that each check allows. Zero on a
  /// quick bus. A check raises no alarm that any time within explains.
  double unsure_s = 0.0;
};

}  // namespace control
