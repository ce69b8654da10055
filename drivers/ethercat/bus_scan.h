/// @file
/// Finds the slaves and what they are.
#pragma once
#include <string>
#include <vector>

#include "drivers/ethercat/register_access.h"
#include "drivers/ethercat/slave.h"

namespace drivers::ethercat {

/// Counts the slaves, gives each the station address 0x1000 + position, reads identities, cabling and SII of
/// all side by side, and lays out the process image. Changes no state and no output, so it may run on a bus
/// that is doing something else.
/// @throws BusError when no frame comes back, no slave answers, more than 256 do, or one's SII is unusable.
std::vector<Slave> scan_bus(RegisterAccess& access, const std::string& interface);

/// One place on the bus: what it is for, and the names that may stand there.
struct ExpectedSlave {
  std::string role;                ///< "wheel 1 (front-left)"
  std::vector<std::string> names;  ///< any of these, compared exactly
};

/// @throws BusError naming the first slave that is missing or another, with the slave and port before it.
void check_topology(const std::vector<Slave>& found, const std::vector<ExpectedSlave>& expected,
                    const std::string& interface);

/// Bytes of the image that one LRW carries.
std::size_t image_bytes(const std::vector<Slave>& slaves);

}  // namespace drivers::ethercat
