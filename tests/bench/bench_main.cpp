// Runs the benchmarks of this process and adds those whose label names a row to the table of figures. Several
// benchmarks of one label form one row, from the fastest to the slowest.
#include <benchmark/benchmark.h>

#include <algorithm>
#include <string>
#include <vector>

#include "tests/bench/figures.h"
#include "tests/bench/quantiles.h"

namespace {

using Run = benchmark::BenchmarkReporter::Run;

double counter(const Run& run, const char* name) { return run.counters.at(name).value; }

/// Of the processor, unless the benchmark asks for the wall's.
double time_s(const Run& run) {
  const double time = run.run_name.time_type.empty() ? run.GetAdjustedCPUTime() : run.GetAdjustedRealTime();
  return time / benchmark::GetTimeUnitMultiplier(run.time_unit);
}

std::string time_text(const Run& run) {
  const double seconds = time_s(run);
  if (seconds >= 1) return bench::number_text(seconds) + " s";
  if (seconds >= 1e-6) return bench::number_text(seconds * 1e6) + " µs";
  return bench::number_text(seconds * 1e9) + " ns";
}

std::string figure_of(const Run& run) {
  if (run.counters.contains(bench::kMedian_us))
    return bench::quantiles_text(counter(run, bench::kMedian_us), counter(run, bench::kP99_9_us));
  if (run.counters.contains("simulated_s_per_s"))
    return bench::number_text(counter(run, "simulated_s_per_s")) + " × real time";
  if (run.counters.contains("rows_per_s"))
    return bench::number_text(counter(run, "rows_per_s")) + " rows a second";
  return time_text(run);
}

class TableReporter final : public benchmark::ConsoleReporter {
 public:
  void ReportRuns(const std::vector<Run>& runs) override {
    ConsoleReporter::ReportRuns(runs);
    for (const Run& run : runs)
      if (!run.error_occurred && !run.report_label.empty() && run.run_type == Run::RT_Iteration)
        runs_.push_back(run);
  }

  void Finalize() override {
    ConsoleReporter::Finalize();
    while (!runs_.empty()) {
      const std::string label = runs_.front().report_label;
      const auto others = std::stable_partition(runs_.begin(), runs_.end(),
                                                [&](const Run& run) { return run.report_label == label; });
      add_row(label, {runs_.begin(), others});
      runs_.erase(runs_.begin(), others);
    }
  }

 private:
  static void add_row(const std::string& label, const std::vector<Run>& runs) {
    const auto [fastest, slowest] = std::minmax_element(
        runs.begin(), runs.end(), [](const Run& a, const Run& b) { return time_s(a) < time_s(b); });
    const std::string& name = fastest->run_name.function_name;
    if (runs.size() == 1) {
      bench::add_figure(label, figure_of(*fastest),
                        "bench " + name + ", " + std::to_string(fastest->iterations) + " times");
      return;
    }
    const auto named = [](const Run& run) {
      const std::string& all = run.run_name.function_name;
      return figure_of(run) + " (" + all.substr(all.find('/') + 1) + ")";
    };
    bench::add_figure(
        label, named(*fastest) + " to " + named(*slowest),
        "bench " + name.substr(0, name.find('/')) + ", the ends of " + std::to_string(runs.size()));
  }

  std::vector<Run> runs_;
};

}  // namespace

int main(int argc, char** argv) {
  benchmark::Initialize(&argc, argv);
  if (benchmark::ReportUnrecognizedArguments(argc, argv)) return 2;
  TableReporter reporter;
  benchmark::RunSpecifiedBenchmarks(&reporter);
  benchmark::Shutdown();
}
