/// @file
/// The motor controllers of a robot, out of operation, each addressed separately.
#pragma once
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "drivers/ethercat/pre_op_bus.h"
#include "drivers/tmcl/transport.h"
#include "drivers/tmcl/youbot_topology.h"
#include "hal/can_robot.h"

namespace youbot_bench {

struct Controller {
  unsigned number = 0;  ///< place on the bus, from 1; on CAN the module's identifier
  std::string name{};   ///< "TMCM-1632", the slave's name; on CAN "module"
  std::string joint{};  ///< "wheel-1"; on a bus that is not a complete youBot "slave-2"
  std::uint8_t motor = 0;
  std::unique_ptr<drivers::tmcl::Transport> transport{};
};

/// Takes the bus to PRE-OP, so nothing may be moving. `bus` must outlive the result. @throws BusError.
std::vector<Controller> controllers_of(drivers::ethercat::PreOpBus& bus, const std::string& interface);
/// The only module of a bench rig. @throws drivers::SetupError.
std::vector<Controller> controllers_on_can(const std::string& interface, const hal::CanOptions& options);

/// Empty if it is not a complete one.
std::optional<drivers::tmcl::YoubotKind> complete_youbot(const std::vector<drivers::ethercat::Slave>& slaves,
                                                         const std::string& interface);

}  // namespace youbot_bench
