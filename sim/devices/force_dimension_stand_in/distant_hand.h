/// @file
/// The other end of a DistantHand: what its process wants, and the time.
#pragma once
#include <chrono>

#include "sim/devices/force_dimension_stand_in.h"

namespace sim::devices {

class DistantHandLink {
 public:
  /// Ends the process when the environment names a file that cannot be used.
  DistantHandLink();
  /// Does nothing and tells 0 when the environment names none. Otherwise the time since it was last told, in
  /// s, at most what a busy machine may take away without a device's watchdog noticing.
  double take(ForceDimensionScript& script);

 private:
  const DistantHand* hand_ = nullptr;
  std::chrono::steady_clock::time_point told_ = std::chrono::steady_clock::now();
};

}  // namespace sim::devices
