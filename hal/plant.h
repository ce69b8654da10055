/// @file
/// The physical robot behind the loopback backend; the HAL owns the interface, the simulator implements it.
#pragma once
#include <chrono>
#include <span>

#include "hal/joint.h"

namespace hal {

/// Called by one thread, in the cycle: no allocation, lock or exception.
class Plant {
 public:
  Plant() = default;
  Plant(const Plant&) = delete;
  Plant& operator=(const Plant&) = delete;
  virtual ~Plant() = default;

  virtual int joint_count() const noexcept = 0;
  /// Writes the current sensor values of the joints; `samples` holds joint_count() entries.
  virtual void measure(std::span<JointSample> samples) noexcept = 0;
  /// Advances by `duration` with finite `commands` applied (joint_count() entries); unpowered drives coast.
  virtual void advance(std::span<const JointCommand> commands, bool powered,
                       std::chrono::nanoseconds duration) noexcept = 0;
};

}  // namespace hal
