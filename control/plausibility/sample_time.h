/// @file
/// When a sample was taken, as far as that is known.
#pragma once
#include <chrono>

#include "hal/robot.h"

namespace control {

inline constexpr double kRegularSample_s = std::chrono::duration<double>(hal::kLongestRegularSample).count();

struct SampleTime {
  double elapsed_s = 0.0;  ///< from the stamp of the last sample to that of this one
  /// So far from its stamp it may have been taken, but for the millisecond that each check allows anyway.
  /// Zero on a bus that is quick. A check raises no alarm that any time within explains.
  double unsure_s = 0.0;
};

}  // namespace control
