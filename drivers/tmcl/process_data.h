/// @file
/// Process data of a youBot motor controller: little-endian, packed (official driver, KU Leuven driver).
///
///   to the drive     0 int32 set value, 4 uint8 mode
///   from the drive   0 int32 position, 4 int32 current, 8 int32 velocity, 12 uint32 flags, and then
///     firmware 1.48  16 int32 PWM
///     firmware 2.0   16 int32 target position, 20 target current, 24 target velocity, 28 ramp velocity
///
/// A slave may map more than is used here (40 bytes each way have been seen). The rest is sent as zero and
/// not read. Motor side throughout: encoder ticks, rpm, mA. All functions are cycle-safe.
#pragma once
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>

#include "drivers/tmcl/firmware_version.h"
#include "drivers/tmcl/status_flags.h"

namespace drivers::tmcl {

enum class ControllerMode : std::uint8_t {
  kMotorStop = 0,
  kPosition = 1,                ///< ticks
  kVelocity = 2,                ///< rpm
  kNoMoreAction = 3,            ///< ignores motion commands from the mailbox; exact meaning undocumented
  kSetPositionToReference = 4,  ///< loads the value into the position counter
  kPwm = 5,
  kCurrent = 6,     ///< mA
  kInitialize = 7,  ///< starts the sine commutation, firmware up to 1.48
};
const char* name(ControllerMode mode) noexcept;

struct DriveOutput {
  ControllerMode mode = ControllerMode::kMotorStop;
  std::int32_t value = 0;
  friend bool operator==(const DriveOutput&, const DriveOutput&) = default;
};

/// Only read back by firmware 2.0.
struct DriveTargets {
  std::int32_t position_ticks = 0;
  std::int32_t current_mA = 0;
  std::int32_t velocity_rpm = 0;
  std::int32_t ramp_velocity_rpm = 0;
  friend bool operator==(const DriveTargets&, const DriveTargets&) = default;
};

struct DriveInput {
  std::int32_t position_ticks = 0;  ///< wraps; see PositionUnwrapper
  std::int32_t current_mA = 0;      ///< possibly without sign; see signed_current_mA()
  std::int32_t velocity_rpm = 0;
  StatusFlags flags;
  std::optional<std::int32_t> pwm;      ///< firmware 1.48
  std::optional<DriveTargets> targets;  ///< firmware 2.0
  friend bool operator==(const DriveInput&, const DriveInput&) = default;
};

inline constexpr std::size_t kOutputBytes = 5;
constexpr std::size_t input_bytes(Firmware firmware) noexcept { return firmware == Firmware::k148 ? 20 : 32; }

// All return false, and change nothing, if `pdo` is too short.
bool pack(const DriveOutput& output, std::span<std::uint8_t> pdo) noexcept;
bool unpack(Firmware firmware, std::span<const std::uint8_t> pdo, DriveInput& input) noexcept;
// The slave's side, for emulated boards.
bool pack(Firmware firmware, const DriveInput& input, std::span<std::uint8_t> pdo) noexcept;
bool unpack(std::span<const std::uint8_t> pdo, DriveOutput& output) noexcept;

/// Whether a drive reports the current with its sign. The thesis behind this project says no, code and
/// manuals say yes; it may depend on the firmware, so it is an option of the device.
enum class CurrentSign : std::uint8_t { kSigned, kAbsolute };

/// The measured current with its sign. For kAbsolute the sign is that of the target current: read back
/// (firmware 2.0), or commanded in current mode; in other modes that of the velocity, a guess that fails when
/// the motor brakes.
std::int32_t signed_current_mA(CurrentSign sign, const DriveInput& input,
                               const DriveOutput& commanded) noexcept;

/// Continuous position from the wrapping 32-bit counter. Valid if it moves less than 2^31 ticks between two
/// updates. Call reset() after the counter has been set (SAP 1, mode 4); otherwise the jump counts as motion.
class PositionUnwrapper {
 public:
  std::int64_t update(std::int32_t ticks) noexcept {
    if (!started_) {
      started_ = true;
      position_ = ticks;
    } else if (!counter_restarted_) {
      // The difference modulo 2^32, read as signed, is the shorter way round.
      position_ +=
          static_cast<std::int32_t>(static_cast<std::uint32_t>(ticks) - static_cast<std::uint32_t>(last_));
    }
    counter_restarted_ = false;
    last_ = ticks;
    return position_;
  }
  void reset() noexcept { *this = {}; }
  /// The counter restarts without motion: the position continues from its value.
  void restart_counter() noexcept { counter_restarted_ = true; }
  std::int64_t position_ticks() const noexcept { return position_; }

 private:
  std::int64_t position_ = 0;
  std::int32_t last_ = 0;
  bool started_ = false;
  bool counter_restarted_ = false;
};

}  // namespace drivers::tmcl
