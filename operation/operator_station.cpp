#include "operation/operator_station.h"

#include <spdlog/fmt/fmt.h>

#include <thread>

#include "drivers/station/udp_port.h"
#include "hal/clock.h"
#include "operation/teleop_run.h"
#include "runtime/log.h"
#include "runtime/real_time.h"
#include "runtime/robot_session.h"
#include "runtime/start_thread.h"
#include "runtime/station/operator_cycle.h"

namespace operation {
namespace {

constexpr std::chrono::milliseconds kLinkLook{50};
constexpr std::chrono::seconds kLinkQuality{10};

/// Until it is stopped.
void log_link(const std::stop_token& ended, runtime::LinkMonitor& monitor, const std::string& peer) {
  const hal::SteadyClock clock;
  drivers::station::LinkReport report;
  bool connected = false;
  std::chrono::nanoseconds logged = clock.now();
  while (!ended.stop_requested()) {
    std::this_thread::sleep_for(kLinkLook);
    monitor.take(report);
    if (report.connected != connected) {
      connected = report.connected;
      if (connected)
        spdlog::info("robot's station {} found", peer);
      else
        spdlog::warn("robot's station {} is silent: the force is off", peer);
    }
    if (!connected || clock.now() - logged < kLinkQuality) continue;
    logged = clock.now();
    spdlog::info("link to {}: {}", peer, runtime::describe(report));
  }
}

}  // namespace

StationSummary run_operator_station(const Config& config, const StationOptions& options,
                                    const std::atomic<bool>& stop) {
  const runtime::LinkOptions& link = config.haptic.link;
  hal::SteadyClock clock;
  const drivers::station::Key key = drivers::station::read_key_file(link.key_file);
  drivers::station::UdpPort port = drivers::station::UdpPort::towards(link.peer);
  const runtime::OpenedHaptic master = open_master(config, clock);
  const runtime::HapticActivation activation(*master.device);
  const hal::HapticInfo& info = master.device->info();
  for (const std::string& warning : info.warnings) spdlog::warn("{}: {}", info.name, warning);
  runtime::LinkMonitor monitor;
  runtime::OperatorCycle cycle(*master.device, port, key, link, &monitor);
  StationSummary summary{.device = info.name};
  {
    const std::jthread logging = runtime::start_thread(
        "the log of the link", [&](const std::stop_token& ended) { log_link(ended, monitor, link.peer); });
    runtime::RealTimeThread real_time;
    for (const std::string& problem :
         runtime::enter_real_time(real_time, config.real_time, options.allow_non_real_time))
      spdlog::warn("not real-time: {}", problem);
    spdlog::info("{} is open; looking for the robot's station {}", info.name, link.peer);
    runtime::run_loop(
        clock, config.cycle.period, cycle,
        [&](std::chrono::nanoseconds elapsed) {
          return stop.load(std::memory_order_relaxed) || (options.duration && elapsed >= *options.duration);
        },
        [](const runtime::CycleTimes& /*times*/) {}, summary.loop);
  }
  summary.link = cycle.report(clock.now());
  if (hal::needs_reopening(cycle.device_status().fault))
    summary.fault = info.name + ": " + master.device->describe(cycle.device_status());
  return summary;
}

std::string report(const StationSummary& summary) {
  return fmt::format(
      "operator's station, {}: {} cycles, {} overruns\n"
      "  link         {}\n"
      "  messages     {} newest, {} overtaken, {} states recovered by repetition, {} refused, {} sessions\n",
      summary.device, summary.loop.cycles, summary.loop.overruns, runtime::describe(summary.link),
      summary.link.newest, summary.link.late, summary.link.recovered, summary.link.refused,
      summary.link.sessions);
}

}  // namespace operation
