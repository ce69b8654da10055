/// @file
/// `--robot` of the commands that examine a bus: scan, parameters, sdo, diagnose.
#pragma once
#include <memory>
#include <string>

#include "drivers/ethercat/link.h"
#include "hal/clock.h"
#include "sim/bus/youbot_bus.h"

namespace youbot_bench {

/// An EtherCAT bus and its clock.
struct Bus {
  std::unique_ptr<sim::bus::YoubotBus> emulation;  ///< for `wire`; otherwise null
  std::unique_ptr<drivers::ethercat::Link> link;
  std::unique_ptr<hal::Clock> clock;
};

/// `ethercat:IFACE`, or `wire`: an emulated base with an arm in this process, which needs no permissions.
/// @throws std::invalid_argument for a robot without such a bus, drivers::ethercat::BusError.
Bus open_bus(const std::string& robot);

/// Help of --robot for a bus.
inline constexpr const char* kBusHelp =
    "ethercat:IFACE, or wire: an emulated base with an arm; loopback and can:IFACE have no EtherCAT bus";

}  // namespace youbot_bench
