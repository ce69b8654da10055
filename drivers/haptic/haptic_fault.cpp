#include "drivers/haptic/haptic_fault.h"

namespace drivers::haptic {

const char* describe(HapticFault fault) noexcept {
  switch (fault) {
    case HapticFault::kNone: return "no fault";
    case HapticFault::kNotActive: return "not active";
    case HapticFault::kNotReady: return "no position yet";
    case HapticFault::kMissed: return "no reply";
    case HapticFault::kBadCommand: return "a force that is not a finite number";
    case HapticFault::kBadSample: return "a measured value that is not a finite number, or not possible";
    case HapticFault::kStale: return "no fresh sample in time";
    case HapticFault::kNoCommand: return "no new force command in time";
    case HapticFault::kTooFast: return "the handle moved too fast";
    case HapticFault::kForceOff: return "the device switched its force off";
    case HapticFault::kLost: return "lost: several replies missing in a row";
    case HapticFault::kUnplugged: return "unplugged";
    case HapticFault::kDeviceFault: return "the device reports a fault";
  }
  return "unknown fault";
}

}  // namespace drivers::haptic
