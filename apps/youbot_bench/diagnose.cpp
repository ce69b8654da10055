#include "apps/youbot_bench/diagnose.h"

#include <CLI/CLI.hpp>

#include <cstdio>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "apps/youbot_bench/bus.h"
#include "drivers/ethercat/pcap_ring.h"
#include "drivers/ethercat/pre_op_bus.h"
#include "drivers/latency_histogram.h"
#include "drivers/tmcl/youbot_topology.h"
#include "hal/clock.h"
#include "hal/seconds.h"
#include "runtime/configuration/finite_range.h"
#include "runtime/program/exit_code.h"
#include "runtime/program/stop_on_signals.h"

namespace youbot_bench {
namespace {

using hal::microseconds;

namespace ethercat = drivers::ethercat;
using std::chrono::nanoseconds;

constexpr std::chrono::milliseconds kPeriod{1};
constexpr std::size_t kCapturedFrames = 2000;  // a second: one out, one back per period
constexpr std::uint8_t kPorts = 4;

/// "up", with the errors counted on the cable: "up, 12 CRC, 1 lost".
std::string port_text(const ethercat::Slave& slave, const ethercat::SlaveErrors& errors, std::uint8_t port) {
  const ethercat::PortErrors& counted = errors.ports[port];
  std::string text = slave.communicates(port) ? "up" : "-";
  if (counted.invalid_frames > 0) text += ", " + std::to_string(counted.invalid_frames) + " CRC";
  if (counted.lost_links > 0) text += ", " + std::to_string(counted.lost_links) + " lost";
  return text;
}

void print_slaves(const ethercat::OpBus& bus) {
  std::printf("%-4s %-14s %-10s %-6s %-16s %-16s %-16s %-16s\n", "pos", "name", "state", "lost", "port 0",
              "port 1", "port 2", "port 3");
  for (std::size_t i = 0; i < bus.size(); ++i) {
    const ethercat::Slave& slave = bus.slave(i);
    const ethercat::SlaveHealth& health = bus.health(i);
    std::printf("%-4u %-14s %-10s %-6llu", slave.position, slave.sii.name.c_str(), to_string(health.state),
                static_cast<unsigned long long>(health.times_lost));
    for (std::uint8_t port = 0; port < kPorts; ++port)
      std::printf(" %-16s", port_text(slave, bus.diagnostics().errors(i), port).c_str());
    std::printf("\n");
  }
}

/// Counts of a diagnosis.
struct Diagnosis {
  const ethercat::OpBus& bus;
  ethercat::FrameCounters frames{};
  drivers::LatencyHistogram wake_up{};
  std::uint64_t short_counters = 0;
  std::vector<std::string> findings{};
  bool sound() const {
    return findings.empty() && short_counters == 0 && frames.lost == 0 && frames.malformed == 0 &&
           frames.not_sent == 0;
  }
};

void print_text(const Diagnosis& diagnosis) {
  print_slaves(diagnosis.bus);
  std::printf(
      "%s\n",
      ethercat::Diagnostics::summary(diagnosis.frames, diagnosis.bus.diagnostics().round_trips()).c_str());
  const drivers::LatencyHistogram& wake_up = diagnosis.wake_up;
  std::printf("wake-up median %.1f us, 99.9 %% within %.1f us, %.1f us at most\n",
              microseconds(wake_up.quantile(0.5)), microseconds(wake_up.quantile(0.999)),
              microseconds(wake_up.worst()));
  std::printf("working counter short in %llu cycles\n",
              static_cast<unsigned long long>(diagnosis.short_counters));
  for (const std::string& finding : diagnosis.findings) std::printf("finding: %s\n", finding.c_str());
  if (diagnosis.sound()) std::printf("nothing wrong was found\n");
}

nlohmann::json json_of(const drivers::LatencyHistogram& times) {
  return {{"median", microseconds(times.quantile(0.5))},
          {"p99_9", microseconds(times.quantile(0.999))},
          {"maximum", microseconds(times.worst())}};
}

void print_json(const Diagnosis& diagnosis) {
  const ethercat::FrameCounters& frames = diagnosis.frames;
  nlohmann::json json{{"sound", diagnosis.sound()},
                      {"findings", diagnosis.findings},
                      {"frames",
                       {{"sent", frames.sent},
                        {"received", frames.received},
                        {"lost", frames.lost},
                        {"malformed", frames.malformed},
                        {"not_sent", frames.not_sent},
                        {"late", frames.late}}},
                      {"short_working_counters", diagnosis.short_counters},
                      {"round_trip_us", json_of(diagnosis.bus.diagnostics().round_trips())},
                      {"wake_up_us", json_of(diagnosis.wake_up)},
                      {"slaves", nlohmann::json::array()}};
  for (std::size_t i = 0; i < diagnosis.bus.size(); ++i) {
    const ethercat::Slave& slave = diagnosis.bus.slave(i);
    nlohmann::json ports = nlohmann::json::array();
    for (std::uint8_t port = 0; port < kPorts; ++port) {
      const ethercat::PortErrors& errors = diagnosis.bus.diagnostics().errors(i).ports[port];
      ports.push_back({{"up", slave.communicates(port)},
                       {"invalid_frames", errors.invalid_frames},
                       {"lost_links", errors.lost_links}});
    }
    json["slaves"].push_back({{"position", slave.position},
                              {"name", slave.sii.name},
                              {"state", to_string(diagnosis.bus.health(i).state)},
                              {"times_lost", diagnosis.bus.health(i).times_lost},
                              {"ports", ports}});
  }
  runtime::print(json);
}

}  // namespace

bool print_diagnosis(ethercat::Link& link, hal::Clock& clock, const DiagnoseOptions& options,
                     const std::atomic<bool>& stop) {
  ethercat::PcapRing capture({.interface = link.name(), .frames = kCapturedFrames});
  ethercat::PreOpBus setup(link, &capture, {});
  drivers::tmcl::require_youbot_boards(setup.slaves());
  setup.enter_pre_op();
  ethercat::OpBus bus = std::move(setup).start();

  Diagnosis diagnosis{.bus = bus};
  const nanoseconds begin = clock.now();
  const nanoseconds duration(static_cast<std::int64_t>(1e9 * options.duration_s));
  nanoseconds reported = begin;
  for (nanoseconds next = begin; next - begin < duration && !stop.load(std::memory_order_relaxed);) {
    next += kPeriod;
    clock.sleep_until(next);
    const nanoseconds now = clock.now();
    diagnosis.wake_up.add(now - next);
    const ethercat::CycleResult result = bus.exchange(now);
    if (bus.other_master_present()) break;  // its slaves must not be taken back
    if (result.answered && result.working_counter != result.expected_working_counter)
      ++diagnosis.short_counters;
    for (std::size_t i = 0; i < bus.size(); ++i) bus.resume(i);
    next += (clock.now() - next) / kPeriod * kPeriod;  // a late cycle keeps the phase
    if (options.quiet || now - reported < std::chrono::seconds(1)) continue;
    reported = now;
    std::fprintf(stderr, "%.0f of %.0f s\n", std::chrono::duration<double>(now - begin).count(),
                 options.duration_s);
  }
  // Before the final frames, which may stay unanswered.
  diagnosis.findings = bus.findings();
  diagnosis.frames = bus.counters();
  bus.leave_op();
  if (!options.capture.empty()) capture.write(options.capture, "youbot-bench diagnose");

  options.format == runtime::Format::kJson ? print_json(diagnosis) : print_text(diagnosis);
  return diagnosis.sound();
}

Subcommand add_diagnose(CLI::App& app) {
  const auto robot = std::make_shared<std::string>();
  const auto options = std::make_shared<DiagnoseOptions>();
  CLI::App* const command = app.add_subcommand(
      "diagnose", "cycle the bus with the motors stopped and report statistics of frames, slaves and cables");
  command->add_option("--robot", *robot, kBusHelp)->required();
  command->add_option("--duration", options->duration_s, "seconds")
      ->check(runtime::finite_range(0.1, 1e6))
      ->capture_default_str();
  command->add_option("--capture", options->capture,
                      "pcapng file for the last second of frames, for Wireshark");
  command->add_flag("--quiet", options->quiet, "no progress");
  runtime::add_json_flag(*command, options->format);
  return {command, [robot, options] {
            const Bus bus = open_bus(*robot);
            runtime::stop_on_signals();
            const bool sound = print_diagnosis(*bus.link, *bus.clock, *options, runtime::stop_requested);
            if (!sound) return runtime::kExitFault;
            return runtime::stop_requested ? runtime::kExitInterrupted : runtime::kExitOk;
          }};
}

}  // namespace youbot_bench
