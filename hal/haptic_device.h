/// @file
/// One exchange per cycle with the haptic device in the operator's hand.
/// Frames as in hal/haptic_sample.h; forces act on the hand.
///
///   device.activate();                                          // set-up: throws hal::SetupError
///   while (running) status = device.exchange(command, sample);  // cycle: never blocks
///   device.deactivate();
#pragma once
#include <Eigen/Core>
#include <chrono>
#include <cstdint>
#include <string>
#include <vector>

#include "drivers/haptic/haptic_fault.h"
#include "hal/haptic_sample.h"

namespace hal {

struct HapticInfo {
  std::string name;            ///< "omega.6, right-handed (serial 4711)"
  double force_limit_N = 0.0;  ///< largest magnitude the device can render; 0: no force feedback
  bool senses_rotation = false;
  /// The pose springs back to the middle by itself: its distance from there asks for a speed.
  bool rate_only = false;
  /// A sample of this age is as good as new: the device's own thread does not keep step with the loop.
  std::chrono::milliseconds fresh_within{10};
  std::vector<std::string> warnings = {};  ///< what an operator should know: "the firmware has no watchdog"
};

struct HapticCommand {
  /// Level, not event: false is zero force. After a fault zero force stays until one exchange with false.
  bool enable = false;
  Eigen::Vector3d f_D_H_N = Eigen::Vector3d::Zero();  ///< scaled down to the device's limit when larger
};

using drivers::haptic::describe;
using drivers::haptic::HapticFault;
using drivers::haptic::needs_reopening;

struct [[nodiscard]] HapticStatus {
  HapticFault fault = HapticFault::kNone;
  /// The device could not make a force in this exchange, though it has a position: it fades in again.
  bool withheld = false;
  bool saturated = false;          ///< the force was scaled down; not a fault
  std::uint32_t detail = 0;        ///< the device's own code; HapticDevice::describe() has it in words
  std::chrono::nanoseconds age{};  ///< of the sample, at the time of this status; max() before the first one
  /// The latest force sent to the device, limited and faded in, as far as is known: no measurement.
  Eigen::Vector3d f_D_H_N = Eigen::Vector3d::Zero();
  bool ok() const noexcept { return fault == HapticFault::kNone; }
};

/// One thread calls exchange(); set-up calls never run beside it. Destruction deactivates.
class HapticDevice {
 public:
  HapticDevice() = default;
  HapticDevice(const HapticDevice&) = delete;
  HapticDevice& operator=(const HapticDevice&) = delete;
  virtual ~HapticDevice() = default;

  /// Complete once active.
  virtual const HapticInfo& info() const noexcept = 0;
  /// Setup: device open, force off. @throws hal::SetupError.
  virtual void activate() = 0;
  /// Force off, device closed. Allowed in any state. False when nothing confirmed that the force is off.
  virtual bool deactivate() noexcept = 0;
  /// Cycle: never blocks. Any fault but kNotReady means zero force until the command was disabled once.
  /// `sample` is left untouched when nothing new came, so its stamp shows its age.
  virtual HapticStatus exchange(const HapticCommand& command, HapticSample& sample) noexcept = 0;
  /// Setup: a status in words, with the device's own reason.
  virtual std::string describe(const HapticStatus& status) const = 0;
};

}  // namespace hal
