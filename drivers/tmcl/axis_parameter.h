/// @file
/// Description of one axis parameter. The parameters themselves: axis_parameters.h.
#pragma once
#include <cstdint>
#include <string_view>

#include "drivers/tmcl/firmware_version.h"
#include "drivers/tmcl/telegram.h"

namespace drivers::tmcl {

/// Meaning of the 32 bits of GAP and SAP.
enum class Unit : std::uint8_t {
  kNone,  ///< a number, a gain or a code
  kTicks,
  kRpm,
  kRpmPerSecond,
  kMilliampere,
  kMilliohm,
  kCentivolt,
  kMillisecond,
  kFiftyMicroseconds,
  kMinute,
  kPerMille,
  kAdcCounts,
  kPwmCounts,  ///< full scale 1799
  kSwitch,     ///< 0 off, 1 on
  kMicrosteps,
};
const char* name(Unit unit) noexcept;

enum class Access : std::uint8_t {
  kRead,
  kWrite,
  kReadWrite,
  kStored,  ///< read and write; STAP stores it in EEPROM. If the manual lacks the number, this follows the
            ///< official driver, and the drive decides
};
constexpr bool readable(Access access) noexcept { return access != Access::kWrite; }
constexpr bool writable(Access access) noexcept { return access != Access::kRead; }
constexpr bool storable(Access access) noexcept { return access == Access::kStored; }

/// kPassword: writing needs parameter 248 first.
enum class Protection : std::uint8_t { kOpen, kPassword };

enum class Generation : std::uint8_t {
  kAll,
  kBefore200,   ///< dropped in firmware 2.0
  kUnverified,  ///< only in the manual of the sister product TMCM-1630
};

struct AxisParameter {
  std::uint8_t number;
  std::string_view name;
  Unit unit;
  std::int32_t min;
  std::int32_t max;
  Access access;
  Protection protection = Protection::kOpen;
  Generation generation = Generation::kAll;
  std::uint8_t module = kDriveModule;

  constexpr bool in_range(std::int32_t value) const noexcept { return min <= value && value <= max; }
  constexpr bool exists_in(Firmware firmware) const noexcept {
    return firmware == Firmware::k148 || generation != Generation::kBefore200;
  }
};

/// GAP and SAP. `motor`: 0 for a drive, 0 or 1 for the gripper's bars.
constexpr Request get(const AxisParameter& parameter, std::uint8_t motor = 0) noexcept {
  return {parameter.module, Command::kGetAxisParameter, parameter.number, motor, 0};
}
constexpr Request set(const AxisParameter& parameter, std::int32_t value, std::uint8_t motor = 0) noexcept {
  return {parameter.module, Command::kSetAxisParameter, parameter.number, motor, value};
}

/// User variables: global parameters of bank 2. 0 to 15 need the password; up to 55 they can be stored in
/// EEPROM (TMCL manual). All others last until power-off, which makes 16 useful.
namespace user_variable {
inline constexpr std::uint8_t kCalibrated = 16;  ///< 1: homed since power-up (official driver)
constexpr bool is_protected(std::uint8_t number) noexcept { return number < 16; }
constexpr bool storable(std::uint8_t number) noexcept { return number < 56; }
}  // namespace user_variable

constexpr Request get_user_variable(std::uint8_t number, std::uint8_t module = kDriveModule) noexcept {
  return {module, Command::kGetGlobalParameter, number, kUserVariableBank, 0};
}
constexpr Request set_user_variable(std::uint8_t number, std::int32_t value,
                                    std::uint8_t module = kDriveModule) noexcept {
  return {module, Command::kSetGlobalParameter, number, kUserVariableBank, value};
}

}  // namespace drivers::tmcl
