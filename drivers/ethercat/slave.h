/// @file
/// The master's data of one slave.
#pragma once
#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "drivers/ethercat/al_status.h"
#include "drivers/ethercat/sii.h"

namespace drivers::ethercat {

/// Location of a slave's process data, in the slave and in the image that one LRW carries.
struct ProcessDataWindow {
  std::uint16_t sync_manager = 0;
  std::uint16_t start = 0;         ///< physical
  std::uint16_t bytes = 0;         ///< 0: none
  std::uint8_t control = 0;        ///< of the sync manager
  std::uint32_t image_offset = 0;  ///< in bytes
};

/// Order of the ports by which a frame leaves a slave and returns to it; it arrived at port 0.
inline constexpr std::array<std::uint8_t, 3> kPortOrder{3, 1, 2};

struct Slave {
  std::uint16_t position = 0;  ///< on the bus, from 1
  std::uint16_t station = 0;   ///< configured address
  std::uint8_t fmmu_count = 0;
  std::uint8_t sync_manager_count = 0;
  std::uint16_t features = 0;
  std::uint8_t port_descriptor = 0;  ///< two bits per port: 0 and 1 mean not present
  std::uint16_t dl_status = 0;
  std::uint16_t parent = 0;      ///< position of the slave before it on the cable, 0: the master
  std::uint8_t parent_port = 0;  ///< of the parent
  SiiInfo sii;
  ProcessDataWindow outputs;
  ProcessDataWindow inputs;
  bool mailbox_fits = false;  ///< sync managers 0 and 1 carry a mailbox

  /// "slave 3 (TMCM-1610)"
  std::string label() const {
    return "slave " + std::to_string(position) + " (" + (sii.name.empty() ? "no name" : sii.name) + ")";
  }
  /// Whether another device is at this port (DL status, bit 9 + 2 port).
  bool communicates(std::uint8_t port) const noexcept { return (dl_status >> (9 + 2 * port) & 1) != 0; }
  bool has_distributed_clock() const noexcept { return (features & 0x0004) != 0; }
};

}  // namespace drivers::ethercat
