/// @file
/// The physical robot behind the loopback backend: the simulator implements it, the HAL owns the interface.
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
  /// Writes what the joints' sensors show now; `samples` holds joint_count() entries.
  virtual void measure(std::span<JointSample> samples) noexcept = 0;
  /// Lets `duration` pass with finite `commands` applied (joint_count() entries); unpowered drives coast.
  virtual void advance(std::span<const JointCommand> commands, bool powered,
                       std::chrono::nanoseconds duration) noexcept = 0;
};

}  // namespace hal
