/// @file
/// Results of the benchmarks, collected in one table (`bench_table`, docs/speed.md).
#pragma once
#include <string>

#include "drivers/latency_histogram.h"

namespace bench {

/// Names the file that the figures are added to; without it they are only printed.
inline constexpr const char* kFiguresVariable = "YOUBOT_FIGURES";

/// One row: quantity, result with its unit, method. A line of the file, with tabs between its cells.
/// @throws std::runtime_error if the file cannot be written.
void add_figure(const std::string& what, const std::string& figure, const std::string& how);

/// Three digits, or all before the point: "0.171", "7.25", "1280".
std::string number_text(double value);
/// "7.25 µs median, 59 µs 99.9 %"
std::string quantiles_text(double median_us, double p99_9_us);
std::string quantiles_text(const drivers::LatencyHistogram& histogram);

}  // namespace bench
