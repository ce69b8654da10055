/// @file
/// Serves an emulated robot on a network interface, by the real clock or in lock-step.
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
  /// Time that the machine was too busy to emulate, and that did not pass for the robot.
  std::chrono::nanoseconds skipped{};
  Lateness::Counts late;  ///< by the clock only
};

/// Until `stop`, or for `duration` (zero: no end). Emulated time is brought up to the clock at least once a
/// millisecond, and before each frame is answered: what the boards say is of now, however long this thread
/// was held up. Answers that came late are logged.
ServerSummary serve(sim::bus::YoubotBus& robot, FramePort& port, std::chrono::nanoseconds duration,
                    const std::atomic<bool>& stop) noexcept;

/// The same by frames: each lets drivers::ethercat::kLockStepPeriod pass after its answer, and without one
/// time stands still, `duration` with it. The master says whether the wheels are on the ground.
ServerSummary serve_in_lock_step(sim::bus::YoubotBus& robot, FramePort& port,
                                 std::chrono::nanoseconds duration, const std::atomic<bool>& stop) noexcept;

std::string report(const ServerSummary& summary, sim::bus::YoubotBus& robot);

}  // namespace youbot_sim
