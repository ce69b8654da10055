/// @file
/// The hand and the device's mechanics behind the haptic loopback; implemented by the simulator.
#pragma once
#include <Eigen/Core>
#include <chrono>

#include "hal/haptic_sample.h"

namespace hal {

/// Called by one thread, in the cycle: no allocation, lock or exception. Frames as in hal/haptic_sample.h.
class HandPlant {
 public:
  HandPlant() = default;
  HandPlant(const HandPlant&) = delete;
  HandPlant& operator=(const HandPlant&) = delete;
  virtual ~HandPlant() = default;

  /// Fills everything but the stamp. The velocity is the true one; a haptic device reports its own estimate.
  virtual void measure(HapticSample& sample) noexcept = 0;
  /// Advances by `duration` with the finite force `f_D_H_N` acting on the handle.
  virtual void advance(const Eigen::Vector3d& f_D_H_N, std::chrono::nanoseconds duration) noexcept = 0;
};

}  // namespace hal
