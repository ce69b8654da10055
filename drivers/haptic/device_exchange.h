/// @file
/// What a haptic device with motors measures and reports in one exchange. hal::HapticServo limits the force,
/// fades it in and keeps faults; a driver does only what its device demands.
///
/// Frames: H is the device's fixed base (x towards the operator, y to the operator's right, z up), D its
/// handle. Forces act on the hand.
#pragma once
#include <array>
#include <cstdint>

#include "drivers/haptic/haptic_fault.h"
#include "drivers/haptic/vector3.h"

namespace drivers::haptic {

struct DeviceSample {
  Vector3 p_HD_m{};
  std::array<Vector3, 3> R_HD{{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}};  ///< by rows
  std::uint32_t buttons = 0;                                       ///< bit i: button i is down
};

struct [[nodiscard]] DeviceStatus {
  HapticFault fault = HapticFault::kNone;
  bool fresh = false;  ///< the sample is from this exchange; otherwise it is unchanged
  /// The device may not make a force in this exchange, and zero was sent: the force has to fade in again.
  bool withheld = false;
  bool saturated = false;   ///< the force was scaled down; not a fault
  std::int32_t detail = 0;  ///< the device's own code for a fault
  Vector3 f_D_H_N{};        ///< the latest force that was sent; no measurement
  bool ok() const noexcept { return fault == HapticFault::kNone; }
};

}  // namespace drivers::haptic
