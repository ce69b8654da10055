#include "apps/youbot_bench/controllers.h"

#include <utility>

#include "drivers/can/socket_can.h"
#include "drivers/ethercat/bus_error.h"
#include "drivers/tmcl/can_transport.h"
#include "drivers/tmcl/mailbox_transport.h"

namespace youbot_bench {

namespace ethercat = drivers::ethercat;
namespace tmcl = drivers::tmcl;

std::optional<tmcl::YoubotKind> complete_youbot(const std::vector<ethercat::Slave>& slaves,
                                                const std::string& interface) {
  using enum tmcl::YoubotKind;
  for (const tmcl::YoubotKind kind : {kBase, kArm, kBaseAndArm, kBaseAndTwoArms}) try {
      check_topology(slaves, tmcl::youbot_topology(kind), interface);
      return kind;
    } catch (const ethercat::BusError&) {
      continue;  // another kind of board
    }
  return std::nullopt;
}

std::vector<Controller> controllers_of(ethercat::PreOpBus& bus, const std::string& interface) {
  const std::optional<tmcl::YoubotKind> kind = complete_youbot(bus.slaves(), interface);
  const std::vector<tmcl::YoubotBoard> boards =
      kind ? youbot_boards(*kind) : std::vector<tmcl::YoubotBoard>();
  tmcl::require_youbot_boards(bus.slaves());
  bus.enter_pre_op();
  std::vector<Controller> controllers;
  for (std::size_t i = 0; i < bus.slaves().size(); ++i) {
    const ethercat::Slave& slave = bus.slaves()[i];
    if (!slave.mailbox_fits || slave.outputs.bytes == 0) continue;  // a power board
    controllers.push_back({.number = slave.position,
                           .name = slave.sii.name,
                           .joint = kind ? joint_name(boards[i]) : "slave-" + std::to_string(slave.position),
                           .transport = std::make_unique<tmcl::SetupMailboxTransport>(bus, i)});
  }
  return controllers;
}

std::vector<Controller> controllers_on_can(const std::string& interface, const hal::CanOptions& options) {
  drivers::can::SocketCan socket({.interface = interface,
                                  .receive_id = options.reply_id,
                                  .bitrate_bit_per_s = options.bitrate_bit_per_s});
  std::vector<Controller> controllers;
  controllers.push_back(
      {.number = options.module_id,
       .name = "module",
       .joint = options.joint_name,
       .motor = options.motor,
       .transport = std::make_unique<tmcl::CanTransport>(
           std::move(socket), tmcl::CanIdentifiers{.module = options.module_id, .reply = options.reply_id})});
  return controllers;
}

}  // namespace youbot_bench
