/// @file
/// Objections of a slave's firmware to the master's configuration at a state request.
#pragma once
#include <cstdint>
#include <span>

#include "sim/bus/fmmu.h"
#include "sim/bus/slave_description.h"

namespace sim::bus {

/// Whether a board enters PRE-OP without its mailbox.
enum class MailboxDemand : std::uint8_t {
  kAlways,         ///< never without
  kWhereSiiNames,  ///< without it if its SII names no mailbox protocol and the master enables neither sync
                   ///< manager
};

/// For PRE-OP. The mailbox sync managers must be enabled exactly as in the SII: start, length, mode and
/// direction; otherwise 0x0016. `optional`: or both off. `registers`: those of the sync managers, from
/// 0x0800, eight bytes each.
std::uint16_t mailbox_obstacle(std::span<const SyncManagerSetting> expected,
                               std::span<const std::uint8_t> registers, bool optional) noexcept;

/// For SAFE-OP. 0x001D (outputs) and 0x001E (inputs) unless the sync manager is enabled in the mode,
/// direction and length of the SII (the master chooses the start; off if the SII has no such data), and if
/// FMMUs touch the data but those of its direction leave out a bit. No FMMU at all is accepted: the data can
/// be read and written by address, and SOEM's ecx_reconfig_slave() maps only after SAFE-OP. 0x0017 if enabled
/// areas overlap, hidden buffers included, or leave process memory, which ends before `memory_end`.
std::uint16_t process_data_obstacle(std::span<const SyncManagerSetting> expected,
                                    std::span<const std::uint8_t> registers, std::span<const Fmmu> fmmus,
                                    std::uint32_t memory_end) noexcept;

}  // namespace sim::bus
