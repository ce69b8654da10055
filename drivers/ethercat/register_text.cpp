#include "drivers/ethercat/register_text.h"

#include <cstdio>

#include "drivers/ethercat/registers.h"

namespace drivers::ethercat {
namespace {

const char* name_of(std::uint16_t address) noexcept {
  switch (address) {
    case reg::kStationAddress: return "station address";
    case reg::kAlControl: return "AL control";
    case reg::kWatchdogDivider: return "watchdog divider";
    case reg::kWatchdogProcessData: return "process data watchdog";
    default: return address < reg::kSyncManager ? "FMMU" : "sync manager";
  }
}

}  // namespace

std::string register_text(std::uint16_t address) {
  char text[64];
  std::snprintf(text, sizeof text, "0x%04X (%s)", unsigned{address}, name_of(address));
  return text;
}

}  // namespace drivers::ethercat
