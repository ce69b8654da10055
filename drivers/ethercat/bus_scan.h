/// @file
/// Finds and identifies the slaves.
#pragma once
#include <string>
#include <vector>

#include "drivers/ethercat/register_access.h"
#include "drivers/ethercat/slave.h"

namespace drivers::ethercat {

/// Counts the slaves, gives each the station address 0x1000 + position, reads identity, cabling and SII of
/// all in parallel, and lays out the process image. Changes no state and no output, so it may run on a bus in
/// operation.
/// @throws BusError if no frame comes back, no slave answers, more than 256 answer, or an SII is unusable.
std::vector<Slave> scan_bus(RegisterAccess& access, const std::string& interface);

/// One place on the bus: its role and the accepted names.
struct ExpectedSlave {
  std::string role;                ///< "wheel 1 (front-left)"
  std::vector<std::string> names;  ///< any of these, compared exactly
};

/// @throws BusError naming the first slave that is missing or differs, with the slave and port before it.
void check_topology(const std::vector<Slave>& found, const std::vector<ExpectedSlave>& expected,
                    const std::string& interface);

/// Size of the image that one LRW carries.
std::size_t image_bytes(const std::vector<Slave>& slaves);

}  // namespace drivers::ethercat
