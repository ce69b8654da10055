/// @file
/// What a slave's firmware has against the master's configuration when a state is asked for.
#pragma once
#include <cstdint>
#include <span>

#include "sim/bus/fmmu.h"
#include "sim/bus/slave_description.h"

namespace sim::bus {

/// Whether a board enters PRE-OP without its mailbox.
enum class MailboxDemand : std::uint8_t {
  kAlways,         ///< never without
  kWhereSiiNames,  ///< if its SII names no mailbox protocol and the master enables neither sync manager
};

/// For PRE-OP. The mailbox sync managers must be enabled just as the SII says: start, length, mode and
/// direction; else 0x0016. `optional`: or both be off. `registers`: the sync managers' own, from 0x0800,
/// eight bytes each.
std::uint16_t mailbox_obstacle(std::span<const SyncManagerSetting> expected,
                               std::span<const std::uint8_t> registers, bool optional) noexcept;

/// For SAFE-OP. 0x001D (outputs) and 0x001E (inputs) unless the sync manager is enabled in the mode,
/// direction and length of the SII (its start is the master's choice; off, if the SII has no such data), and
/// when FMMUs touch the data but those of its direction leave a bit out. No FMMU at all is accepted: the data
/// can be read and written by address, and SOEM's ecx_reconfig_slave() maps only after SAFE-OP.
/// 0x0017 when enabled areas overlap, hidden buffers included, or leave process memory, which ends before
/// `memory_end`.
std::uint16_t process_data_obstacle(std::span<const SyncManagerSetting> expected,
                                    std::span<const std::uint8_t> registers, std::span<const Fmmu> fmmus,
                                    std::uint32_t memory_end) noexcept;

}  // namespace sim::bus
