#include "apps/youbot_sim/server.h"

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <array>

#include "drivers/ethercat/frame.h"
#include "drivers/ethercat/simulated_bus.h"
#include "runtime/log.h"

namespace youbot_sim {
namespace {

using std::chrono::nanoseconds;

/// In lock-step, where nothing is due without a frame: maximum wait until the stop flag is checked.
constexpr nanoseconds kLongestPause = std::chrono::milliseconds(100);
/// Further behind, emulation would never catch up, or would run through the watchdogs at once.
constexpr nanoseconds kLongestCatchUp = std::chrono::milliseconds(50);

void pass_replies_on(sim::bus::EmulatedWire& wire, FramePort& port, std::span<std::uint8_t> buffer,
                     ServerSummary& summary) noexcept {
  for (std::size_t size = wire.receive(buffer); size > 0; size = wire.receive(buffer))
    ++(port.send(buffer.first(size)) ? summary.answered : summary.refused);
}

}  // namespace

ServerSummary serve(sim::bus::YoubotBus& robot, FramePort& port, nanoseconds duration,
                    const std::atomic<bool>& stop) noexcept {
  ServerSummary summary;
  std::array<std::uint8_t, drivers::ethercat::kMaxFrameBytes> buffer;
  std::array<std::uint8_t, drivers::ethercat::kMaxFrameBytes> replies;
  sim::bus::EmulatedWire& wire = robot.wire();

  Lateness lateness;
  const nanoseconds start = port.now();
  nanoseconds emulated = start;  // clock time that the robot has reached
  while (!stop.load(std::memory_order_relaxed) && (duration.count() == 0 || emulated - start < duration)) {
    // Mechanics advance at the end of a period: done in time, they delay no frame.
    nanoseconds sleep = robot.until_period();
    if (const auto due = wire.next_reply()) sleep = std::clamp(*due - wire.now(), nanoseconds(0), sleep);
    const FramePort::Frame frame = port.receive(buffer, sleep);
    const nanoseconds now = port.now();
    const nanoseconds behind = now - emulated;
    const nanoseconds step = std::min(behind, kLongestCatchUp);
    summary.skipped += behind - step;
    robot.advance(step);
    emulated = now;
    pass_replies_on(wire, port, replies, summary);
    if (frame.size > 0) {
      ++summary.received;
      wire.send(std::span(buffer).first(frame.size));
      const std::uint64_t answered = summary.answered;
      pass_replies_on(wire, port, replies, summary);
      if (summary.answered > answered) lateness.add(port.now() - frame.came);
    }
    if (const auto late = lateness.due(now))
      spdlog::warn("{}: the machine is busy, or this program has no real-time priority", describe(*late));
  }
  summary.duration = emulated - start;
  summary.late = lateness.total();
  return summary;
}

ServerSummary serve_in_lock_step(sim::bus::YoubotBus& robot, FramePort& port, nanoseconds duration,
                                 const std::atomic<bool>& stop) noexcept {
  ServerSummary summary;
  std::array<std::uint8_t, drivers::ethercat::kMaxFrameBytes> buffer;
  sim::bus::EmulatedWire& wire = robot.wire();
  while (!stop.load(std::memory_order_relaxed) && (duration.count() == 0 || wire.now() < duration)) {
    const std::size_t size = port.receive(buffer, kLongestPause).size;
    if (size == 0) continue;
    ++summary.received;
    wire.send(std::span(buffer).first(size));
    pass_replies_on(wire, port, buffer, summary);
    const auto& first_slave = robot.bus().slave(0).controller();
    robot.set_on_ground(first_slave.get<std::uint8_t>(drivers::ethercat::kLiftedAddress) == 0);
    robot.advance(drivers::ethercat::kLockStepPeriod);
    pass_replies_on(wire, port, buffer, summary);
  }
  summary.duration = wire.now();
  return summary;
}

std::string report(const ServerSummary& summary, sim::bus::YoubotBus& robot) {
  const auto seconds = [](nanoseconds time) { return std::chrono::duration<double>(time).count(); };
  std::string text = fmt::format("served {:.1f} s: {} frames received, {} answered\n",
                                 seconds(summary.duration), summary.received, summary.answered);
  if (summary.late.late > 0) text += describe(summary.late) + "\n";
  if (robot.has_base()) {
    const auto& pose = robot.pose();
    text += fmt::format("base at x {:.3f} m, y {:.3f} m, yaw {:.3f} rad\n", pose.x_m, pose.y_m, pose.yaw_rad);
  }
  const std::size_t wheels = robot.has_base() ? 4 : 0;
  for (std::size_t arm = 0; arm < robot.arm_count(); ++arm) {
    text += fmt::format("arm {} at", arm + 1);
    for (std::size_t i = 0; i < 5; ++i)
      text += fmt::format(" {:.3f}", robot.position_rad(wheels + 5 * arm + i));
    text += " rad\n";
  }
  return text;
}

}  // namespace youbot_sim
