#include "apps/youbot_bench/scan.h"

#include <CLI/CLI.hpp>

#include <array>
#include <cstdio>
#include <memory>
#include <nlohmann/json.hpp>
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
#include "runtime/program/json_output.h"
#include "runtime/program/printable.h"

namespace youbot_bench {
namespace {

namespace ethercat = drivers::ethercat;
namespace tmcl = drivers::tmcl;
using runtime::Format;

std::vector<std::string> protocols_of(const ethercat::Slave& slave) {
  namespace protocol = ethercat::mailbox_protocol;
  static constexpr std::array<std::pair<std::uint16_t, const char*>, 6> kNames{{{protocol::kAoe, "AoE"},
                                                                                {protocol::kEoe, "EoE"},
                                                                                {protocol::kCoe, "CoE"},
                                                                                {protocol::kFoe, "FoE"},
                                                                                {protocol::kSoe, "SoE"},
                                                                                {protocol::kVoe, "VoE"}}};
  std::vector<std::string> protocols;
  for (const auto& [bit, name] : kNames)
    if ((slave.sii.mailbox_protocols & bit) != 0) protocols.emplace_back(name);
  return protocols;
}

/// Which youBot this is, or which one is closest.
struct Verdict {
  tmcl::YoubotKind kind{};
  std::string complaint{};   // empty: complete
  std::string simulation{};  // mark in its EEPROMs; empty: none
};

Verdict verdict_on(const std::vector<ethercat::Slave>& slaves, const std::string& interface) {
  if (const auto kind = complete_youbot(slaves, interface)) {
    const bool simulated = first_without(ethercat::kSimulatedMark, slaves) == nullptr ||
                           first_without(ethercat::kLockStepMark, slaves) == nullptr;
    return {.kind = *kind, .simulation = simulated ? slaves.front().sii.group : ""};
  }
  const bool arm_only = slaves.front().sii.is_called("KR-843");
  const bool base_only = slaves.size() <= 5;
  Verdict verdict{.kind = arm_only              ? tmcl::YoubotKind::kArm
                          : base_only           ? tmcl::YoubotKind::kBase
                          : slaves.size() <= 11 ? tmcl::YoubotKind::kBaseAndArm
                                                : tmcl::YoubotKind::kBaseAndTwoArms};
  try {
    check_topology(slaves, tmcl::youbot_topology(verdict.kind), interface);
  } catch (const ethercat::BusError& error) {
    verdict.complaint = error.what();
  }
  return verdict;
}

void print_text(const std::vector<ethercat::Slave>& slaves, const std::string& interface) {
  std::printf("%-4s %-14s %-10s %-10s %-10s %-8s %-12s %-10s %-9s %s\n", "pos", "name", "vendor", "product",
              "revision", "behind", "out/in bytes", "mailbox", "protocols", "clock");
  for (const ethercat::Slave& slave : slaves) {
    const std::string behind = slave.parent == 0
                                   ? interface.substr(0, 8)
                                   : std::to_string(slave.parent) + ":" + std::to_string(slave.parent_port);
    const std::string bytes = std::to_string(slave.outputs.bytes) + "/" + std::to_string(slave.inputs.bytes);
    const std::string mailbox = slave.mailbox_fits ? std::to_string(slave.sii.mailbox_out.length) + "/" +
                                                         std::to_string(slave.sii.mailbox_in.length)
                                                   : "none";
    std::string protocols;
    for (const std::string& name : protocols_of(slave)) protocols += (protocols.empty() ? "" : "+") + name;
    std::printf("%-4u %-14s 0x%08X 0x%08X 0x%08X %-8s %-12s %-10s %-9s %s\n", slave.position,
                runtime::printable_entry(slave.sii.name).c_str(), slave.sii.vendor, slave.sii.product,
                slave.sii.revision, behind.c_str(), bytes.c_str(), mailbox.c_str(),
                protocols.empty() ? "none" : protocols.c_str(),
                slave.has_distributed_clock() ? "yes" : "none");
  }
  const Verdict verdict = verdict_on(slaves, interface);
  if (verdict.complaint.empty())
    std::printf("this is a complete youBot: %s%s%s\n", name_of(verdict.kind).data(),
                verdict.simulation.empty() ? "" : ", ", verdict.simulation.c_str());
  else
    std::printf("this is no complete youBot; as %s: %s\n", name_of(verdict.kind).data(),
                verdict.complaint.c_str());
}

void print_json(const std::vector<ethercat::Slave>& slaves, const std::string& interface) {
  const Verdict verdict = verdict_on(slaves, interface);
  nlohmann::json scan{{"interface", interface},
                      {"kind", name_of(verdict.kind)},
                      {"complete", verdict.complaint.empty()},
                      {"complaint", verdict.complaint},
                      {"simulation", verdict.simulation},
                      {"slaves", nlohmann::json::array()}};
  for (const ethercat::Slave& slave : slaves)
    scan["slaves"].push_back({{"position", slave.position},
                              {"name", slave.sii.name},
                              {"vendor", slave.sii.vendor},
                              {"product", slave.sii.product},
                              {"revision", slave.sii.revision},
                              {"serial", slave.sii.serial},
                              {"behind_slave", slave.parent},
                              {"behind_port", slave.parent_port},
                              {"output_bytes", slave.outputs.bytes},
                              {"input_bytes", slave.inputs.bytes},
                              {"mailbox", slave.mailbox_fits},
                              {"protocols", protocols_of(slave)},
                              {"distributed_clock", slave.has_distributed_clock()}});
  runtime::print(scan);
}

}  // namespace

void print_scan(ethercat::Link& link, Format format) {
  ethercat::Transceiver transceiver(link);
  ethercat::RegisterAccess access(transceiver, {});
  const std::vector<ethercat::Slave> slaves = scan_bus(access, link.name());
  format == Format::kJson ? print_json(slaves, link.name()) : print_text(slaves, link.name());
}

Subcommand add_scan(CLI::App& app) {
  const auto robot = std::make_shared<std::string>();
  const auto format = std::make_shared<Format>(Format::kText);
  CLI::App* const command =
      app.add_subcommand("scan", "list the slaves on the bus and how they are cabled; changes nothing");
  command->add_option("--robot", *robot, kBusHelp)->required();
  runtime::add_json_flag(*command, *format);
  return {command, [robot, format] {
            print_scan(*open_bus(*robot).link, *format);
            return runtime::kExitOk;
          }};
}

}  // namespace youbot_bench
