/// @file
/// The library's end of a DistantHand: commands of the other process, and the time.
#pragma once
#include <chrono>

#include "sim/devices/force_dimension_stand_in.h"

namespace sim::devices {

class DistantHandLink {
 public:
  /// Ends the process if the environment names an unusable file.
  DistantHandLink();
  /// Does nothing and returns 0 if the environment names none. Otherwise returns the time since the last
  /// call, in s, limited so that a pause of a busy machine does not trigger a device's watchdog.
  double take(ForceDimensionScript& script);

 private:
  const DistantHand* hand_ = nullptr;
  std::chrono::steady_clock::time_point updated_ = std::chrono::steady_clock::now();
};

}  // namespace sim::devices
