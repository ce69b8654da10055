#include "drivers/haptic/force_dimension_sdk.h"

#include <array>
#include <span>

namespace drivers::haptic {
namespace {

constexpr std::array kErrors = {
    "no error",
    "error without a reason",
    "communication error",
    "the controller is busy",
    "no driver for the device",
    "no device",
    "not available: the device or function is missing or held by another program",
    "time-out",
    "the geometry does not allow it",
    "needs expert mode",
    "not implemented",
    "out of memory",
    "the device is not ready",
    "file not found",
    "bad configuration",
    "no device or axis with this index",
    "deprecated",
    "null argument",
    "redundant sensors disagree",
    "not enabled",
    "the device is in use",
    "invalid argument",
    "no regulation is running",
};
static_assert(kErrors.size() == 23);

constexpr std::array kForceOff = {
    "no cause given",
    "its force button",
    "an axis moved faster than the device's velocity threshold",
    "the watchdog: no force command came in time",
    "a program asked for it",
    "the USB connection was lost",
    "the dead man's switch was let go",
};

const char* pick(std::span<const char* const> words, int number, const char* otherwise) noexcept {
  const bool known = number >= 0 && static_cast<std::size_t>(number) < words.size();
  return known ? words[static_cast<std::size_t>(number)] : otherwise;
}

}  // namespace

const char* describe_sdk_error(int code) noexcept { return pick(kErrors, code, "unknown error"); }
const char* describe_force_off(int cause) noexcept { return pick(kForceOff, cause, "an unknown cause"); }

const char* describe_system_type(int type) noexcept {
  switch (type) {
    case 0: return "no device";
    case 33: return "omega.3";
    case kOmega6Right: return "omega.6, right-handed";
    case 35: return "omega.7, right-handed";
    case kOmega6Left: return "omega.6, left-handed";
    case 37: return "omega.7, left-handed";
    case 60: return "Falcon";
    case 63: return "delta.3";
    case 81:
    case 82: return "controller";
    case 91: return "custom device";
    case 104:
    case 105: return "sigma.7";
    case 108:
    case 109: return "lambda.7";
    case 131:
    case 132: return "lambda.6";
    case 203: return "lambda.3";
    case 206: return "sigma.3";
    default: return "another device";
  }
}

}  // namespace drivers::haptic
