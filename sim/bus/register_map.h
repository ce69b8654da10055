/// @file
/// Register bits of a controller that the master may change directly (ESC data sheet section II).
#pragma once
#include <array>
#include <cstddef>
#include <cstdint>

#include "drivers/ethercat/registers.h"

namespace sim::bus {

inline constexpr std::size_t kRegisterBytes = drivers::ethercat::reg::kProcessMemory;
/// From here on registers are plain memory, written while the frame passes, not at its end.
inline constexpr std::uint16_t kUserMemory = 0x0F80;

/// Registers with a side effect (EEPROM, sync managers, error counters, receive and system time) are 0 here
/// and handled by EmulatedSlave, as are read-only and reserved ones.
constexpr std::array<std::uint8_t, kRegisterBytes> writable_bits() {
  namespace reg = drivers::ethercat::reg;
  std::array<std::uint8_t, kRegisterBytes> bits{};
  const auto open = [&bits](std::size_t first, std::size_t count, std::uint8_t mask = 0xFF) {
    for (std::size_t i = first; i < first + count; ++i) bits[i] = mask;
  };
  open(reg::kStationAddress, 2);
  open(reg::kDlControl, 4);
  open(reg::kAlControl, 2);
  open(reg::kEventMask, 2);
  open(reg::kWatchdogDivider, 2);
  open(reg::kWatchdogPdi, 2);
  open(reg::kWatchdogProcessData, 2);
  for (std::size_t fmmu = reg::kFmmu; fmmu < reg::kFmmu + 16U * reg::kFmmuBytes; fmmu += reg::kFmmuBytes) {
    open(fmmu, 6);             // logical start, length
    open(fmmu + 6, 2, 0x07);   // logical start and stop bit
    open(fmmu + 8, 2);         // physical start
    open(fmmu + 10, 1, 0x07);  // physical start bit
    open(fmmu + 11, 1, 0x03);  // read, write
    open(fmmu + 12, 1, 0x01);  // active
  }
  open(reg::kDcSystemTimeOffset, 8);
  open(reg::kDcSystemTimeDelay, 4);
  open(reg::kDcSpeedCounterStart, 2);
  open(reg::kDcSystemTimeFilter, 2, 0x0F);
  open(reg::kDcActivation, 1, 0x31);
  open(reg::kDcActivation + 1, 1, 0x7F);
  open(reg::kDcStartTime, 8);
  open(reg::kDcSync0Cycle, 8);  // and SYNC1
  open(kUserMemory, kRegisterBytes - kUserMemory);
  return bits;
}

inline constexpr std::array<std::uint8_t, kRegisterBytes> kWritableBits = writable_bits();

}  // namespace sim::bus
