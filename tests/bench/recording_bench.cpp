// Cost of a recording for the recorded cycle, and the write rate to disk.
#include <benchmark/benchmark.h>

#include <chrono>

#include "hal/clock.h"
#include "operation/base_recording.h"
#include "tests/bench/quantiles.h"
#include "tests/support/temporary_directory.h"

namespace recording_bench {

using namespace std::chrono_literals;

constexpr double kFiles = 5;  // a row of a cycle in each: four wheels and the base

/// Numbers of as many digits as real ones have.
operation::CycleRecord record_at(int cycle) {
  operation::CycleRecord record;
  record.time = cycle * 1ms;
  record.phase = operation::Phase::kRunning;
  for (std::size_t i = 0; i < 4; ++i) {
    record.position_rad[i] = 1.234567e-3 * cycle + static_cast<double>(i);
    record.torque_command_Nm[i] = record.torque_measured_Nm[i] = 0.1 + 1e-7 * cycle;
    record.velocity_rad_per_s[i] = record.reported_velocity_rad_per_s[i] = 1.234567;
  }
  record.reference_W = record.odometry_W = record.truth_W = {0.1 * cycle, 0.2 * cycle, 0.3 * cycle};
  return record;
}

operation::BaseRecording::Description into(const support::TemporaryDirectory& directory) {
  return operation::base_recording({.directory = directory / "run",
                                    .config = {directory.write("config.toml", "")},
                                    .experiment = "bench",
                                    .period = 1ms});
}

void check(benchmark::State& state, const operation::BaseRecording& recording) {
  if (recording.cycles_lost() > 0 || !recording.problems().empty())
    state.SkipWithError("the recording is not whole");
}

/// In a cycle of 1 kHz, with all that such a pause takes out of the caches.
void RecordACycle(benchmark::State& state) {
  state.SetLabel("recorder: add() in a cycle of 1 kHz");
  const support::TemporaryDirectory directory;
  operation::BaseRecording recording(into(directory));
  hal::SteadyClock clock;
  drivers::LatencyHistogram histogram;
  int cycle = 0;
  std::chrono::nanoseconds next = clock.now();
  for (auto _ : state) {
    const operation::CycleRecord record = record_at(cycle++);
    clock.sleep_until(next += 1ms);
    const std::chrono::nanoseconds begin = clock.now();
    recording.add(record);
    histogram.add(clock.now() - begin);
  }
  recording.close();
  check(state, recording);
  bench::set_quantiles(state, histogram);
}
BENCHMARK(RecordACycle)->Iterations(3000)->UseRealTime();

/// As fast as the writer takes them, to the end of its last write to the disk.
void RecordToDisk(benchmark::State& state) {
  state.SetLabel("recorder: to the disk, five rows a cycle");
  constexpr int kCycles = 100'000;
  for (auto _ : state) {
    const support::TemporaryDirectory directory;
    operation::BaseRecording recording(into(directory));
    for (int cycle = 0; cycle < kCycles; ++cycle) {
      recording.wait_for_room();
      recording.add(record_at(cycle));
    }
    recording.close();
    check(state, recording);
  }
  state.counters["rows_per_s"] =
      benchmark::Counter(kFiles * kCycles, benchmark::Counter::kIsIterationInvariantRate);
}
BENCHMARK(RecordToDisk)->Iterations(1)->UseRealTime()->Unit(benchmark::kSecond);

}  // namespace recording_bench
