/// @file
/// Why a haptic device makes no force. One list for every device and for the limits above it.
#pragma once
#include <cstdint>

namespace drivers::haptic {

enum class HapticFault : std::uint8_t {
  kNone,
  kNotActive,
  kNotReady,     ///< no position yet (not homed): no force. The only one that ends by itself
  kMissed,       ///< no reply to this exchange. hal::HapticServo counts it as a sample that is not new
  kBadCommand,   ///< a force was not finite
  kBadSample,    ///< a measured value is not finite or not possible
  kStale,        ///< no fresh sample, or the exchange itself came late: the force is zero
  kNoCommand,    ///< the loop that gives the forces stopped giving them
  kTooFast,      ///< the handle moved faster than hal::HapticLimits::speed_m_per_s
  kForceOff,     ///< the device switched its force off
  kLost,         ///< several replies in a row are missing
  kUnplugged,    ///< device disconnected or not responding
  kDeviceFault,  ///< the device reports an error or refused a call
};
/// In words, for messages: "a force that is not a finite number".
const char* describe(HapticFault fault) noexcept;

/// The device itself failed: deactivate, then activate it again.
constexpr bool needs_reopening(HapticFault fault) noexcept {
  return fault == HapticFault::kForceOff || fault == HapticFault::kLost || fault == HapticFault::kUnplugged ||
         fault == HapticFault::kDeviceFault;
}

}  // namespace drivers::haptic
