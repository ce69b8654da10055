#include "apps/youbot_bench/scan.h"

#include <CLI/CLI.hpp>

#include <array>
#include <cstdio>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "apps/youbot_bench/bus.h"
#include "apps/youbot_bench/controllers.h"
#include "drivers/ethercat/bus_error.h"
#include "drivers/ethercat/pre_op_bus.h"
#include "drivers/ethercat/simulated_bus.h"
#include "drivers/tmcl/youbot_topology.h"
#include "runtime/program/exit_code.h"

namespace youbot_bench {
namespace {

namespace ethercat = drivers::ethercat;
namespace tmcl = drivers::tmcl;

/// "CoE+FoE": what its mailbox speaks. TMCL, as the youBot's boards speak it, has no bit.
std::string protocols_of(const ethercat::Slave& slave) {
  using namespace ethercat::mailbox_protocol;
  static constexpr std::array<std::pair<std::uint16_t, const char*>, 6> kNames{
      {{kAoe, "AoE"}, {kEoe, "EoE"}, {kCoe, "CoE"}, {kFoe, "FoE"}, {kSoe, "SoE"}, {kVoe, "VoE"}}};
  std::string protocols;
  for (const auto& [bit, name] : kNames)
    if ((slave.sii.mailbox_protocols & bit) != 0)
      protocols += (protocols.empty() ? "" : "+") + std::string(name);
  return protocols.empty() ? "none" : protocols;
}

/// Which youBot this is; for the kind it comes closest to, what is wrong.
void print_verdict(const std::vector<ethercat::Slave>& slaves, const std::string& interface) {
  if (const auto kind = complete_youbot(slaves, interface)) {
    // A simulation says so in its EEPROMs.
    const bool simulated = first_without(ethercat::kSimulatedMark, slaves) == nullptr ||
                           first_without(ethercat::kLockStepMark, slaves) == nullptr;
    std::printf("this is a complete youBot: %s%s%s\n", name_of(*kind).data(), simulated ? ", " : "",
                simulated ? slaves.front().sii.group.c_str() : "");
    return;
  }
  const bool arm_only = slaves.front().sii.is_called("KR-843");
  const bool base_only = slaves.size() <= 5;
  const tmcl::YoubotKind nearest = arm_only              ? tmcl::YoubotKind::kArm
                                   : base_only           ? tmcl::YoubotKind::kBase
                                   : slaves.size() <= 11 ? tmcl::YoubotKind::kBaseAndArm
                                                         : tmcl::YoubotKind::kBaseAndTwoArms;
  try {
    check_topology(slaves, tmcl::youbot_topology(nearest), interface);
  } catch (const ethercat::BusError& error) {
    std::printf("this is no complete youBot; as %s: %s\n", name_of(nearest).data(), error.what());
  }
}

}  // namespace

void print_scan(ethercat::Link& link) {
  ethercat::Transceiver transceiver(link);
  ethercat::RegisterAccess access(transceiver, {});
  const std::vector<ethercat::Slave> slaves = scan_bus(access, link.name());
  std::printf("%-4s %-14s %-10s %-10s %-10s %-8s %-12s %-10s %-9s %s\n", "pos", "name", "vendor", "product",
              "revision", "behind", "out/in bytes", "mailbox", "protocols", "clock");
  for (const ethercat::Slave& slave : slaves) {
    const std::string behind = slave.parent == 0
                                   ? link.name().substr(0, 8)
                                   : std::to_string(slave.parent) + ":" + std::to_string(slave.parent_port);
    const std::string bytes = std::to_string(slave.outputs.bytes) + "/" + std::to_string(slave.inputs.bytes);
    const std::string mailbox = slave.mailbox_fits ? std::to_string(slave.sii.mailbox_out.length) + "/" +
                                                         std::to_string(slave.sii.mailbox_in.length)
                                                   : "none";
    std::printf("%-4u %-14s 0x%08X 0x%08X 0x%08X %-8s %-12s %-10s %-9s %s\n", slave.position,
                slave.sii.name.c_str(), slave.sii.vendor, slave.sii.product, slave.sii.revision,
                behind.c_str(), bytes.c_str(), mailbox.c_str(), protocols_of(slave).c_str(),
                slave.has_distributed_clock() ? "yes" : "none");
  }
  print_verdict(slaves, link.name());
}

Subcommand add_scan(CLI::App& app) {
  const auto robot = std::make_shared<std::string>();
  CLI::App* const command =
      app.add_subcommand("scan", "list the slaves on the bus and how they are cabled; changes nothing");
  command->add_option("--robot", *robot, kBusHelp)->required();
  return {command, [robot] {
            print_scan(*open_bus(*robot).link);
            return runtime::kExitOk;
          }};
}

}  // namespace youbot_bench
