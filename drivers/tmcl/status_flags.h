/// @file
/// The drive's error and status word: bytes 12 to 15 of the process data, and axis parameter 156. Bits and
/// resets from the official youBot driver and the KU Leuven driver's notes on them.
#pragma once
#include <array>
#include <cstddef>
#include <cstdint>

namespace drivers::tmcl {

/// Values are bit numbers.
enum class StatusFlag : std::uint8_t {
  kOvercurrent = 0,
  kUndervoltage = 1,
  kOvervoltage = 2,
  kOvertemperature = 3,
  kMotorHalted = 4,
  kHallSensorError = 5,
  kEncoderError = 6,
  kInitializationError = 7,
  kPwmMode = 8,
  kVelocityMode = 9,
  kPositionMode = 10,
  kCurrentMode = 11,
  kEmergencyStop = 12,
  kFreeRunning = 13,
  kPositionReached = 14,
  kInitialized = 15,  ///< commutation known: the motor can be commanded
  kTimeout = 16,      ///< the drive's watchdog: no process data for the time in parameter 90
  kI2tExceeded = 17,  ///< thermal model of the winding over its limit; PWM is held at 0
};
inline constexpr int kStatusFlagCount = 18;

enum class FlagKind : std::uint8_t {
  kState,
  kWarning,  ///< the drive still obeys
  kError,    ///< the drive does not obey, or must not be asked to move
};

enum class FlagReset : std::uint8_t {
  kAutomatic,     ///< clears with its cause
  kClearTimeout,  ///< SAP 158, on explicit request only: the joint may move again
  kClearI2t,      ///< SAP 29, accepted only after the thermal winding time in parameter 25
};

struct FlagInfo {
  StatusFlag flag;
  const char* name;
  FlagKind kind;
  FlagReset reset;
};

/// Ordered by bit. Later firmware leaves 6, 7, 8, 12 and 13 at zero (official driver). That driver logs all
/// errors as warnings; this classification is ours: undervoltage and overtemperature stop the joint in the KU
/// Leuven driver, 5 to 7 make the commutation unreliable, 2, 12, 16 and 17 disable the motor.
inline constexpr std::array<FlagInfo, kStatusFlagCount> kStatusFlags{{
    {StatusFlag::kOvercurrent, "overcurrent", FlagKind::kWarning, FlagReset::kAutomatic},
    {StatusFlag::kUndervoltage, "undervoltage", FlagKind::kError, FlagReset::kAutomatic},
    {StatusFlag::kOvervoltage, "overvoltage", FlagKind::kError, FlagReset::kAutomatic},
    {StatusFlag::kOvertemperature, "overtemperature", FlagKind::kError, FlagReset::kAutomatic},
    {StatusFlag::kMotorHalted, "motor halted", FlagKind::kState, FlagReset::kAutomatic},
    {StatusFlag::kHallSensorError, "hall sensor error", FlagKind::kError, FlagReset::kAutomatic},
    {StatusFlag::kEncoderError, "encoder error", FlagKind::kError, FlagReset::kAutomatic},
    {StatusFlag::kInitializationError, "commutation start-up error", FlagKind::kError, FlagReset::kAutomatic},
    {StatusFlag::kPwmMode, "PWM mode", FlagKind::kState, FlagReset::kAutomatic},
    {StatusFlag::kVelocityMode, "velocity mode", FlagKind::kState, FlagReset::kAutomatic},
    {StatusFlag::kPositionMode, "position mode", FlagKind::kState, FlagReset::kAutomatic},
    {StatusFlag::kCurrentMode, "current mode", FlagKind::kState, FlagReset::kAutomatic},
    {StatusFlag::kEmergencyStop, "emergency stop", FlagKind::kError, FlagReset::kAutomatic},
    {StatusFlag::kFreeRunning, "free running", FlagKind::kState, FlagReset::kAutomatic},
    {StatusFlag::kPositionReached, "position reached", FlagKind::kState, FlagReset::kAutomatic},
    {StatusFlag::kInitialized, "commutation initialised", FlagKind::kState, FlagReset::kAutomatic},
    {StatusFlag::kTimeout, "process data timeout", FlagKind::kError, FlagReset::kClearTimeout},
    {StatusFlag::kI2tExceeded, "I2t exceeded", FlagKind::kError, FlagReset::kClearI2t},
}};
constexpr const FlagInfo& info(StatusFlag flag) noexcept {
  return kStatusFlags[static_cast<std::size_t>(flag)];
}
/// How the flag is cleared.
const char* describe(FlagReset reset) noexcept;

class StatusFlags {
 public:
  constexpr StatusFlags() noexcept = default;
  constexpr explicit StatusFlags(std::uint32_t raw) noexcept : raw_(raw) {}

  constexpr bool has(StatusFlag flag) const noexcept {
    return (raw_ >> static_cast<unsigned>(flag) & 1U) != 0;
  }
  /// The flags of this kind only.
  constexpr StatusFlags of(FlagKind kind) const noexcept {
    std::uint32_t mask = 0;
    for (const FlagInfo& entry : kStatusFlags) {
      if (entry.kind == kind) mask |= 1U << static_cast<unsigned>(entry.flag);
    }
    return StatusFlags(raw_ & mask);
  }
  constexpr StatusFlags without(StatusFlag flag) const noexcept {
    return StatusFlags(raw_ & ~(1U << static_cast<unsigned>(flag)));
  }
  constexpr StatusFlags errors() const noexcept { return of(FlagKind::kError); }
  constexpr bool any() const noexcept { return raw_ != 0; }
  constexpr std::uint32_t raw() const noexcept { return raw_; }
  friend constexpr bool operator==(StatusFlags, StatusFlags) noexcept = default;

 private:
  std::uint32_t raw_ = 0;
};

}  // namespace drivers::tmcl
