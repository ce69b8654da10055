/// @file
/// Quantiles over the single runs of a benchmark, whose reported time is their mean.
#pragma once
#include <benchmark/benchmark.h>

#include <chrono>

#include "drivers/latency_histogram.h"

namespace bench {

inline constexpr const char* kMedian_us = "median_us";
inline constexpr const char* kP99_9_us = "p99_9_us";

inline void set_quantiles(benchmark::State& state, const drivers::LatencyHistogram& histogram) {
  const auto microseconds = [&](double fraction) {
    return std::chrono::duration<double, std::micro>(histogram.quantile(fraction)).count();
  };
  state.counters[kMedian_us] = microseconds(0.5);
  state.counters[kP99_9_us] = microseconds(0.999);
}

}  // namespace bench
