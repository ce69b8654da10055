/// @file
/// Fault scripts as files.
#pragma once
#include <cstddef>
#include <filesystem>
#include <vector>

#include "sim/bus/fault_script.h"

namespace youbot_sim {

/// One table per event; every key except `kind` has the default of sim::bus::FaultEvent:
///   [[fault]]
///   kind = "slave_off"   # drop_request drop_reply delay duplicate truncate corrupt wrong_counter
///                        # damage_on_cable slave_off cable_out brown_out mailbox_hung board_fault
///                        # foreign_write
///   at_s = 2.0           # or at_frame = 1000; from when the bus is served
///   duration_s = 1.5     # 0: forever
///   slave = 3            # place on the bus, from 1 as in all messages; or the cable that leads to it
/// and, depending on the kind: count, delay_s, offset, mask, counter_change, datagram, value, and board_fault
/// = "stuck_encoder" | "hall_sensor" | "undervoltage" | "overvoltage" | "overtemperature". `slaves` is their
/// number. @throws runtime::ConfigError
std::vector<sim::bus::FaultEvent> load_faults(const std::filesystem::path& path, std::size_t slaves);

}  // namespace youbot_sim
