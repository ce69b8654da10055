/// @file
/// What the page of every run shows: faults, phases, limits touched and cycle times.
#pragma once
#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include "drivers/latency_histogram.h"
#include "operation/run_summary.h"
#include "operation/run_trace.h"
#include "report/report.h"
#include "runtime/loop.h"

namespace operation {

/// x of all plots over time, which are linked.
inline report::Axis time_axis() { return {.label = "time", .unit = "s", .link = "time"}; }

/// A plot over time with the spans of phases.
report::Plot over_time(const std::string& title, const report::Axis& y, std::vector<report::Series> series,
                       const std::vector<report::Span>& spans, std::string note = {});
/// Of the table in "Summary".
report::Row summary_row(const std::string& what, const std::string& value, const std::string& meaning);

/// A command this close to its limit is limited, as rounding goes.
inline bool is_at_limit(double command, double limit) noexcept {
  return std::abs(command) >= (1 - 1e-9) * limit;
}

/// How often and how long something held. One thread.
class Occurrences {
 public:
  void add(double time_s, bool holds) noexcept {
    now_ = holds ? now_ + 1 : 0;
    longest_ = std::max(longest_, now_);
    if (now_ == 1) ++times_;
    if (holds && cycles_++ == 0) first_s_ = time_s;
  }
  std::uint64_t cycles() const noexcept { return cycles_; }
  std::uint64_t times() const noexcept { return times_; }
  std::uint64_t longest() const noexcept { return longest_; }  ///< cycles
  double first_s() const noexcept { return first_s_; }

 private:
  std::uint64_t cycles_ = 0;
  std::uint64_t times_ = 0;
  std::uint64_t longest_ = 0;
  std::uint64_t now_ = 0;  // cycles since it began to hold
  double first_s_ = 0.0;
};

/// Collects cycles, then adds its sections to a page. One thread.
class RunPage {
 public:
  /// A limit of this kind of run; with `only_if_touched` it is listed only if it was touched.
  struct Limit {
    std::string name;
    bool only_if_touched = false;
  };
  RunPage(std::chrono::nanoseconds period, const std::vector<Limit>& more_limits);

  /// One cycle; `phase` is a constant text, `limited` as in the record, `touched` for each of `more_limits`.
  void add(std::chrono::nanoseconds time, const char* phase, std::uint8_t limited,
           const std::vector<bool>& touched, const runtime::CycleTimes& times);

  double duration_s() const noexcept { return duration_s_; }
  /// Phases, and the fault as a line.
  std::vector<report::Span> spans(const RunSummary& summary) const;

  /// ", stopped by a fault", or empty.
  static const char* end_in_title(const RunSummary& summary) {
    return summary.stop_reason.empty() ? "" : ", stopped by a fault";
  }
  /// First: a paragraph for a run that ended well, otherwise time, cause and files.
  static void add_end(report::Page& page, const RunSummary& summary);
  /// Last: limits touched, phases, cycle times.
  void add_rest(report::Page& page, const RunSummary& summary) const;

 private:
  void add_phases(report::Page& page) const;
  void add_limits(report::Page& page) const;
  void add_cycle_times(report::Page& page, const RunSummary& summary) const;

  struct Touched {
    Limit limit;
    Occurrences occurrences;
  };

  double period_s_;
  double duration_s_ = 0.0;
  std::uint64_t cycles_ = 0;
  std::vector<report::Span> phases_;
  std::vector<Touched> limits_;
  TimeTrace times_us_{2};
  drivers::LatencyHistogram wake_up_;
  drivers::LatencyHistogram step_;
};

}  // namespace operation
