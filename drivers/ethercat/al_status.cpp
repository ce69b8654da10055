#include "drivers/ethercat/al_status.h"

namespace drivers::ethercat {

const char* to_string(AlState state) noexcept {
  switch (state) {
    case AlState::kNone: return "no state";
    case AlState::kInit: return "INIT";
    case AlState::kPreOp: return "PRE-OP";
    case AlState::kBoot: return "BOOT";
    case AlState::kSafeOp: return "SAFE-OP";
    case AlState::kOp: return "OP";
  }
  return "an unknown state";
}

const char* describe_al_status_code(std::uint16_t code) noexcept {
  switch (code) {
    case 0x0000: return "no error";
    case 0x0001: return "unspecified error";
    case 0x0002: return "no memory";
    case 0x0003: return "invalid device setup";
    case 0x0004: return "invalid revision";
    case 0x0006: return "SII and firmware do not match";
    case 0x0007: return "firmware update failed, the old one still runs";
    case 0x0011: return "invalid requested state change";
    case 0x0012: return "unknown requested state";
    case 0x0013: return "bootstrap not supported";
    case 0x0014: return "no valid firmware";
    case 0x0015: return "invalid mailbox configuration (BOOT)";
    case 0x0016: return "invalid mailbox configuration (PRE-OP)";
    case 0x0017: return "invalid sync manager configuration";
    case 0x0018: return "no valid inputs available";
    case 0x0019: return "no valid outputs";
    case 0x001A: return "synchronization error";
    case 0x001B: return "sync manager watchdog: process data stopped";
    case 0x001C: return "invalid sync manager types";
    case 0x001D: return "invalid output configuration";
    case 0x001E: return "invalid input configuration";
    case 0x001F: return "invalid watchdog configuration";
    case 0x0020: return "slave needs a cold start";
    case 0x0021: return "slave needs INIT";
    case 0x0022: return "slave needs PRE-OP";
    case 0x0023: return "slave needs SAFE-OP";
    case 0x0024: return "invalid input mapping";
    case 0x0025: return "invalid output mapping";
    case 0x0026: return "inconsistent settings";
    case 0x0027: return "free-run not supported";
    case 0x0028: return "synchronous mode not supported";
    case 0x0029: return "free-run needs 3-buffer mode";
    case 0x002A: return "background watchdog";
    case 0x002B: return "no valid inputs and outputs";
    case 0x002C: return "fatal synchronization error";
    case 0x002D: return "no synchronization signal";
    case 0x002E: return "cycle time too small";
    case 0x0030: return "invalid distributed-clock SYNC configuration";
    case 0x0031: return "invalid distributed-clock latch configuration";
    case 0x0032: return "phase-locked loop error";
    case 0x0033: return "distributed-clock input/output error";
    case 0x0034: return "distributed-clock timeout";
    case 0x0035: return "invalid distributed-clock SYNC cycle time";
    case 0x0036: return "distributed-clock SYNC0 cycle time does not fit";
    case 0x0037: return "distributed-clock SYNC1 cycle time does not fit";
    case 0x0041: return "AoE mailbox";
    case 0x0042: return "EoE mailbox";
    case 0x0043: return "CoE mailbox";
    case 0x0044: return "FoE mailbox";
    case 0x0045: return "SoE mailbox";
    case 0x004F: return "VoE mailbox";
    case 0x0050: return "EEPROM cannot be accessed";
    case 0x0051: return "EEPROM error";
    case 0x0060: return "slave restarted locally";
    case 0x0061: return "device identification updated";
    case 0x00F0: return "application controller available";
    default: return "code not in the standard's table";
  }
}

}  // namespace drivers::ethercat
