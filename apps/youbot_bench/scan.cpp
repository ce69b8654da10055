#include "apps/youbot_bench/scan.h"

#include <cstdio>
#include <exception>
#include <optional>
#include <vector>

#include "drivers/ethercat/bus_error.h"
#include "drivers/ethercat/pre_op_bus.h"
#include "drivers/tmcl/axis_parameters.h"
#include "drivers/tmcl/client.h"
#include "drivers/tmcl/mailbox_transport.h"
#include "drivers/tmcl/youbot_topology.h"

namespace youbot_bench {
namespace {

namespace ethercat = drivers::ethercat;
namespace tmcl = drivers::tmcl;

struct NamedKind {
  const char* name;
  tmcl::YoubotKind kind;
};
constexpr NamedKind kKinds[] = {{"base", tmcl::YoubotKind::kBase},
                                {"arm", tmcl::YoubotKind::kArm},
                                {"base+arm", tmcl::YoubotKind::kBaseAndArm},
                                {"base+two-arms", tmcl::YoubotKind::kBaseAndTwoArms}};

/// Which youBot this is; for the kind it comes closest to, what is wrong.
void print_verdict(const std::vector<ethercat::Slave>& slaves, const std::string& interface) {
  for (const NamedKind& candidate : kKinds) try {
      check_topology(slaves, tmcl::youbot_topology(candidate.kind), interface);
      std::printf("this is a complete youBot: %s\n", candidate.name);
      return;
    } catch (const ethercat::BusError&) {
      continue;  // another kind, then
    }
  const bool arm_only = slaves.front().sii.is_called("KR-843");
  const bool base_only = slaves.size() <= 5;
  const NamedKind& nearest = arm_only              ? kKinds[1]
                             : base_only           ? kKinds[0]
                             : slaves.size() <= 11 ? kKinds[2]
                                                   : kKinds[3];
  try {
    check_topology(slaves, tmcl::youbot_topology(nearest.kind), interface);
  } catch (const ethercat::BusError& error) {
    std::printf("this is no complete youBot; as %s: %s\n", nearest.name, error.what());
  }
}

}  // namespace

void print_scan(ethercat::Link& link) {
  ethercat::Transceiver transceiver(link);
  ethercat::RegisterAccess access(transceiver, {});
  const std::vector<ethercat::Slave> slaves = scan_bus(access, link.name());
  std::printf("%-4s %-14s %-10s %-10s %-10s %-8s %-12s %-10s\n", "pos", "name", "vendor", "product",
              "revision", "behind", "out/in bytes", "mailbox");
  for (const ethercat::Slave& slave : slaves) {
    const std::string behind = slave.parent == 0
                                   ? link.name().substr(0, 8)
                                   : std::to_string(slave.parent) + ":" + std::to_string(slave.parent_port);
    const std::string bytes = std::to_string(slave.outputs.bytes) + "/" + std::to_string(slave.inputs.bytes);
    const std::string mailbox = slave.mailbox_fits ? std::to_string(slave.sii.mailbox_out.length) + "/" +
                                                         std::to_string(slave.sii.mailbox_in.length)
                                                   : "none";
    std::printf("%-4u %-14s 0x%08X 0x%08X 0x%08X %-8s %-12s %-10s\n", slave.position, slave.sii.name.c_str(),
                slave.sii.vendor, slave.sii.product, slave.sii.revision, behind.c_str(), bytes.c_str(),
                mailbox.c_str());
  }
  print_verdict(slaves, link.name());
}

void print_parameters(ethercat::Link& link) {
  ethercat::PreOpBus bus(link, nullptr, {});
  bus.enter_pre_op();
  std::printf("slave,name,firmware,number,parameter,value,unit\n");
  for (std::size_t i = 0; i < bus.slaves().size(); ++i) {
    const ethercat::Slave& slave = bus.slaves()[i];
    if (!slave.mailbox_fits || slave.outputs.bytes == 0) continue;  // a power board
    tmcl::SetupMailboxTransport transport(bus, i);
    tmcl::SteadyClock clock;
    tmcl::Client client(transport, clock);
    const tmcl::FirmwareVersion version = client.version();
    const std::optional<tmcl::Firmware> firmware = tmcl::supported_firmware(version);
    for (const tmcl::AxisParameter& parameter : tmcl::kDriveParameters) {
      if (!readable(parameter.access) || (firmware && !parameter.exists_in(*firmware))) continue;
      std::string value;
      try {
        value = std::to_string(client.get(parameter));
      } catch (const std::exception& error) {
        std::fprintf(stderr, "youbot-bench: %s\n", error.what());
        value = "refused";
      }
      std::printf("%u,%s,%d,%u,%.*s,%s,%s\n", slave.position, slave.sii.name.c_str(), version.version,
                  parameter.number, static_cast<int>(parameter.name.size()), parameter.name.data(),
                  value.c_str(), name(parameter.unit));
    }
  }
}

}  // namespace youbot_bench
