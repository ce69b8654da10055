/// @file
/// One exchange per cycle with the master in the operator's hand.
/// Frames as in hal/haptic_sample.h; forces act on the hand.
#pragma once
#include <Eigen/Core>
#include <cstdint>
#include <string>

#include "hal/haptic_sample.h"

namespace hal {

struct HapticInfo {
  std::string name;
  double force_limit_N = 0.0;  ///< largest magnitude the device can render; 0: no force feedback
  bool senses_rotation = false;
};

struct HapticCommand {
  /// Level, not event: false is zero force. After a fault zero force stays until one exchange with false.
  bool enable = false;
  Eigen::Vector3d f_D_H_N = Eigen::Vector3d::Zero();  ///< scaled down to the device's limit when larger
};

enum class HapticFault : std::uint8_t {
  kNone,
  kNotActive,
  kBadCommand,  ///< a force was not finite
  kBadSample,   ///< a measured value was not finite
  kStale,       ///< no fresh sample: the force is zero
  kUnplugged,
  kDeviceFault,  ///< detail: the device's own code
};

struct [[nodiscard]] HapticStatus {
  HapticFault fault = HapticFault::kNone;
  bool saturated = false;  ///< the force was scaled down; not a fault
  std::uint32_t detail = 0;
  bool ok() const noexcept { return fault == HapticFault::kNone; }
};

/// One thread calls exchange(); set-up calls never run beside it.
class HapticDevice {
 public:
  HapticDevice() = default;
  HapticDevice(const HapticDevice&) = delete;
  HapticDevice& operator=(const HapticDevice&) = delete;
  virtual ~HapticDevice() = default;

  virtual const HapticInfo& info() const noexcept = 0;
  /// Setup: device open, force off. @throws hal::SetupError.
  virtual void activate() = 0;
  /// Force off, device closed. Allowed in any state.
  virtual void deactivate() noexcept = 0;
  /// Cycle: never blocks. Any fault means zero force until the command was disabled once. `sample` is left
  /// untouched when nothing new came, so its stamp shows its age.
  virtual HapticStatus exchange(const HapticCommand& command, HapticSample& sample) noexcept = 0;
};

}  // namespace hal
