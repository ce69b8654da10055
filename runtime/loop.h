/// @file
/// The loop around the cycle: absolute deadlines, no drift, statistics.
#pragma once
#include <chrono>
#include <cstdint>

#include "drivers/latency_histogram.h"
#include "hal/clock.h"
#include "runtime/real_time.h"

namespace runtime {

/// Times of the last cycle.
struct CycleTimes {
  std::chrono::nanoseconds wake_up{};  ///< after its deadline
  std::chrono::nanoseconds step{};     ///< time the cycle took
};

struct LoopStatistics {
  std::uint64_t cycles = 0;
  std::uint64_t overruns = 0;  ///< periods skipped because a cycle ended after the next deadline
  std::chrono::nanoseconds robot_time{};
  std::chrono::nanoseconds wall_time{};
  drivers::LatencyHistogram wake_up;  ///< after the deadline; zero in virtual time
  drivers::LatencyHistogram step;     ///< always on the machine's clock
  Disturbances disturbances;          ///< of the loop after its first tenth of a second
};

/// Calls `cycle.step` every `period` of `clock` until it has finished. A late cycle keeps the phase: missed
/// deadlines are skipped and counted. `stop_wanted(elapsed)` and `after_step(record)` are called once per
/// cycle by this thread and are part of it. A cycle has step(now), request_stop(), finished() and record(),
/// the record of the last step with members wake_up and step.
template <typename Cycle, typename StopRequested, typename AfterStep>
void run_loop(hal::Clock& clock, std::chrono::nanoseconds period, Cycle& cycle, StopRequested&& stop_wanted,
              AfterStep&& after_step, LoopStatistics& statistics) noexcept {
  constexpr std::chrono::milliseconds kWarmUp{100};
  const hal::SteadyClock stopwatch;
  const std::chrono::nanoseconds wall_begin = stopwatch.now();
  const std::chrono::nanoseconds begin = clock.now();
  std::chrono::nanoseconds deadline = begin;
  Disturbances warm;
  bool warmed_up = false;

  while (!cycle.finished()) {
    deadline += period;
    clock.sleep_until(deadline);
    const std::chrono::nanoseconds woke = clock.now();
    const std::chrono::nanoseconds step_begin = stopwatch.now();
    if (!warmed_up && woke - begin >= kWarmUp) {
      warmed_up = true;
      warm = Disturbances::of_this_thread();
    }

    if (stop_wanted(woke - begin)) cycle.request_stop();
    cycle.step(woke);
    auto& record = cycle.record();
    record.wake_up = woke - deadline;
    record.step = stopwatch.now() - step_begin;
    statistics.wake_up.add(record.wake_up);
    statistics.step.add(record.step);
    ++statistics.cycles;
    after_step(record);

    const auto missed = (clock.now() - deadline) / period;
    statistics.overruns += static_cast<std::uint64_t>(missed);
    deadline += missed * period;
  }
  if (warmed_up) statistics.disturbances = Disturbances::of_this_thread().since(warm);
  statistics.robot_time = clock.now() - begin;
  statistics.wall_time = stopwatch.now() - wall_begin;
}

}  // namespace runtime
