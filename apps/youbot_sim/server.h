/// @file
/// Serves an emulated robot on a network interface, in real time or in lock-step.
#pragma once
#include <atomic>
#include <chrono>
#include <cstdint>
#include <string>

#include "apps/youbot_sim/frame_port.h"
#include "apps/youbot_sim/lateness.h"
#include "sim/bus/youbot_bus.h"

namespace youbot_sim {

struct ServerSummary {
  std::chrono::nanoseconds duration{};
  std::uint64_t received = 0;
  std::uint64_t answered = 0;
  std::uint64_t refused = 0;  ///< by the interface
  /// Time for which the machine was too busy to emulate, and which did not pass for the robot.
  std::chrono::nanoseconds skipped{};
  Lateness::Counts late;  ///< in real time only
};

/// Until `stop`, or for `duration` (zero: no end). Emulated time catches up with the clock at least once per
/// millisecond, and before each answer: the boards' values are current, however long this thread was delayed.
/// Logs late answers.
ServerSummary serve(sim::bus::YoubotBus& robot, FramePort& port, std::chrono::nanoseconds duration,
                    const std::atomic<bool>& stop) noexcept;

/// The same in lock-step: each frame advances time by drivers::ethercat::kLockStepPeriod after its answer;
/// without frames time, including `duration`, does not advance. The master determines whether the wheels are
/// on the ground.
ServerSummary serve_in_lock_step(sim::bus::YoubotBus& robot, FramePort& port,
                                 std::chrono::nanoseconds duration, const std::atomic<bool>& stop) noexcept;

std::string report(const ServerSummary& summary, sim::bus::YoubotBus& robot);

}  // namespace youbot_sim
