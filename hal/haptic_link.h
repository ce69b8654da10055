/// @file
/// The seam below hal::HapticDevice: one device, whose exchange may block.
#pragma once
#include <chrono>
#include <string>

#include "hal/haptic_device.h"

namespace hal {

/// One thread at a time. Destruction closes.
class HapticLink {
 public:
  HapticLink() = default;
  HapticLink(const HapticLink&) = delete;
  HapticLink& operator=(const HapticLink&) = delete;
  virtual ~HapticLink() = default;

  /// Complete once open.
  virtual const HapticInfo& info() const noexcept = 0;
  /// Setup: device open, force off. @throws hal::SetupError.
  virtual void open() = 0;
  /// Force off, device closed. Allowed in any state. False when nothing confirmed that the force is off.
  virtual bool close() noexcept = 0;
  /// Cycle: sends the force, zero with `enable` false, and reads. Waits for the device's answer, some
  /// milliseconds at most. The force is finite and within the info's limit. Fills pose, buttons and stamp,
  /// not the velocity; `sample` is unchanged when nothing new came. The status holds the force that was sent.
  /// HapticServo keeps faults and fades the force in: a link reports kNotReady without a position, `withheld`
  /// when it could not make the force.
  virtual HapticStatus exchange(const HapticCommand& command, std::chrono::nanoseconds now,
                                HapticSample& sample) noexcept = 0;
  /// Setup: what HapticStatus::detail means.
  virtual std::string describe(const HapticStatus& status) const { return hal::describe(status.fault); }
};

}  // namespace hal
