/// @file
/// Serves an emulated robot on a network interface, by the real clock or in lock-step.
#pragma once
#include <atomic>
#include <chrono>
#include <cstdint>
#include <string>

#include "apps/youbot_sim/frame_socket.h"
#include "sim/bus/youbot_bus.h"

namespace youbot_sim {

struct ServerSummary {
  std::chrono::nanoseconds duration{};
  std::uint64_t received = 0;
  std::uint64_t answered = 0;
  std::uint64_t refused = 0;  ///< by the interface
  /// Time that the machine was too busy to emulate, and that did not pass for the robot.
  std::chrono::nanoseconds skipped{};
};

/// Until `stop`, or for `duration` (zero: no end). Each frame is answered first and emulated time brought up
/// to the clock afterwards, at least once a millisecond.
ServerSummary serve(sim::bus::YoubotBus& robot, FrameSocket& socket, std::chrono::nanoseconds duration,
                    const std::atomic<bool>& stop) noexcept;

/// The same by frames: each lets drivers::ethercat::kLockStepPeriod pass after its answer, and without one
/// time stands still, `duration` with it. The master says whether the wheels are on the ground.
ServerSummary serve_in_lock_step(sim::bus::YoubotBus& robot, FrameSocket& socket,
                                 std::chrono::nanoseconds duration, const std::atomic<bool>& stop) noexcept;

std::string report(const ServerSummary& summary, sim::bus::YoubotBus& robot);

}  // namespace youbot_sim
