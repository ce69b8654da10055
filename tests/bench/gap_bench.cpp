// Wall time of the whole search for missing effects, from recordings in memory to the result: five recordings
// of a given duration at 1 kHz from a drive that lacks a Stribeck curve and a ripple. The time grows at most
// linearly with the data (BigO).
#include <benchmark/benchmark.h>

#include <string>

#include "tests/gap/gap_cases.h"

namespace gap_bench {

void GapSearch(benchmark::State& state) {
  using enum gap_test::Hidden;
  constexpr double kMeanLength_s = 23.6;  // of the five, at length 1
  const auto seconds = static_cast<double>(state.range(0));
  gap_test::Case gap_case =
      gap_test::make_case({gap_test::CaseKind::kPair, {kStribeck, kCogging}, 4, 7}, seconds / kMeanLength_s);
  for (auto _ : state) {
    const identification::gap::Result result = identification::gap::analyse(gap_case.base, gap_case.data, {});
    if (result.effects.size() < 2) state.SkipWithError("does not find what is hidden");
  }
  double samples = 0;
  for (const identification::gap::Source& source : gap_case.data)
    samples += static_cast<double>(source.recording.rows());
  state.SetLabel("youbot-gap: five recordings of " + std::to_string(state.range(0)) +
                 " s at 1 kHz, two hidden effects");
  state.SetComplexityN(static_cast<benchmark::IterationCount>(samples));
  state.counters["recorded_s"] = samples * 1e-3;
}
BENCHMARK(GapSearch)
    ->Arg(15)
    ->Arg(30)
    ->Arg(60)
    ->Arg(120)
    ->Unit(benchmark::kSecond)
    ->UseRealTime()
    ->Iterations(1)
    ->Complexity(benchmark::oN);

}  // namespace gap_bench
