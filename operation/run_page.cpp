#include "operation/run_page.h"

#include <spdlog/fmt/fmt.h>

#include <cmath>
#include <filesystem>
#include <system_error>

#include "hal/seconds.h"
#include "operation/cycle_record.h"

namespace operation {
namespace {

constexpr std::size_t kMaxPhases = 200;

/// Bits of `limited`.
constexpr auto kLimiters = std::to_array<std::pair<std::uint8_t, const char*>>(
    {{limiter::kEffort, "force, moment or torque at its limit"},
     {limiter::kTorqueRate, "torque changed as fast as allowed"},
     {limiter::kWorkspace, "set-point held at a workspace limit"},
     {limiter::kSetpoint, "set-point at its limit of speed, acceleration or jerk"}});

/// Share of the cycles that took longer than x, from all of them down to a single one.
report::Series slower_than(const char* name, const drivers::LatencyHistogram& histogram) {
  constexpr int kPointsPerDecade = 8;
  report::Series series{.name = name, .x = {}, .y = {}};
  const auto count = static_cast<double>(histogram.count());
  for (int i = 0; count > 0; ++i) {
    const double share = std::max(1 / count, std::pow(10.0, -static_cast<double>(i) / kPointsPerDecade));
    series.x.push_back(hal::microseconds(histogram.quantile(1 - share)));
    series.y.push_back(100 * share);
    if (share * count <= 1) break;
  }
  return series;
}

}  // namespace

report::Plot over_time(const std::string& title, const report::Axis& y, std::vector<report::Series> series,
                       const std::vector<report::Span>& spans, std::string note) {
  return {.title = title,
          .x = time_axis(),
          .y = y,
          .series = std::move(series),
          .note = std::move(note),
          .spans = spans};
}

report::Row summary_row(const std::string& what, const std::string& value, const std::string& meaning) {
  return {what, value, meaning};
}

RunPage::RunPage(std::chrono::nanoseconds period, const std::vector<Limit>& more_limits)
    : period_s_(hal::seconds(period)) {
  for (const auto& [bit, name] : kLimiters) limits_.push_back({{name}, {}});
  for (const Limit& limit : more_limits) limits_.push_back({limit, {}});
}

void RunPage::add(std::chrono::nanoseconds time, const char* phase, std::uint8_t limited,
                  const std::vector<bool>& touched, const runtime::CycleTimes& times) {
  const double time_s = hal::seconds(time);
  ++cycles_;
  duration_s_ = time_s;
  if (phases_.empty() || (phases_.back().name != phase && phases_.size() < kMaxPhases))
    phases_.push_back({phase, time_s, time_s});
  phases_.back().to = time_s;
  if (phases_.size() > 1) phases_[phases_.size() - 2].to = phases_.back().from;
  for (std::size_t i = 0; i < kLimiters.size(); ++i)
    limits_[i].occurrences.add(time_s, (limited & kLimiters[i].first) != 0);
  for (std::size_t i = 0; i < touched.size(); ++i)
    limits_[kLimiters.size() + i].occurrences.add(time_s, touched[i]);
  times_us_.add(time_s, std::array{hal::microseconds(times.wake_up), hal::microseconds(times.step)});
  wake_up_.add(times.wake_up);
  step_.add(times.step);
}

std::vector<report::Span> RunPage::spans(const RunSummary& summary) const {
  std::vector<report::Span> spans = phases_;
  if (summary.stop_reason.empty()) return spans;
  const double fault_s = hal::seconds(summary.stop_time);
  spans.push_back({"fault", fault_s, fault_s});
  return spans;
}

void RunPage::add_end(report::Page& page, const RunSummary& summary) {
  for (const std::string& problem : summary.not_real_time) page.text("Not real-time: " + problem + ".");
  if (summary.cycles_lost > 0)
    page.text(std::to_string(summary.cycles_lost) +
              " cycles are missing in the recording and, in part, here.");
  for (const std::string& problem : summary.recording_problems) page.text("Recording: " + problem + ".");
  if (summary.stop_reason.empty()) {
    page.text(summary.cut_short ? "No fault. Stopped before the motion was finished." : "No fault.");
    return;
  }
  page.heading("Fault");
  std::vector<report::Row> rows{
      {std::string("time"), fmt::format("{:.3f} s", hal::seconds(summary.stop_time))},
      {std::string("cause"), summary.stop_reason}};
  if (summary.fault_report) {
    const auto add = [&](const char* what, const std::filesystem::path& path) {
      std::error_code unknown;
      if (!std::filesystem::exists(path, unknown)) return;
      const std::string name = path.filename().string();
      // Elsewhere, if the directory of the recording could not take it.
      if (path.parent_path() == summary.record_directory)
        rows.push_back({std::string(what), report::Link{name, name}});
      else
        rows.push_back({std::string(what), path.string()});
    };
    add("the last second, each cycle", *summary.fault_report);
    add("frames of the bus, for Wireshark",
        std::filesystem::path(*summary.fault_report).replace_extension(".pcapng"));
  }
  page.table({{"fault"}, {"value"}}, rows);
}

void RunPage::add_rest(report::Page& page, const RunSummary& summary) const {
  add_limits(page);
  add_phases(page);
  add_cycle_times(page, summary);
}

void RunPage::add_phases(report::Page& page) const {
  page.heading("Phases");
  std::vector<report::Row> rows;
  for (const report::Span& phase : phases_)
    rows.push_back({phase.name, phase.from, phase.to, phase.to - phase.from});
  page.table({{"phase"}, {"from", "s", 3}, {"to", "s", 3}, {"duration", "s", 3}}, rows);
}

void RunPage::add_limits(report::Page& page) const {
  page.heading("Limits touched");
  std::vector<report::Row> rows;
  for (const auto& [limit, touched] : limits_) {
    if (limit.only_if_touched && touched.cycles() == 0) continue;
    const auto seconds = [this](std::uint64_t cycles) { return static_cast<double>(cycles) * period_s_; };
    const bool never = touched.cycles() == 0;
    rows.push_back({limit.name, static_cast<double>(touched.cycles()), seconds(touched.cycles()),
                    100 * static_cast<double>(touched.cycles()) / static_cast<double>(cycles_),
                    static_cast<double>(touched.times()),
                    never ? CycleRecord::kNaN : seconds(touched.longest()),
                    never ? CycleRecord::kNaN : touched.first_s()});
  }
  page.table({{"limit"},
              {"cycles"},
              {"time", "s", 3},
              {"of the run", "%", 2},
              {"times"},
              {"longest", "s", 3},
              {"first at", "s", 3}},
             rows);
}

void RunPage::add_cycle_times(report::Page& page, const RunSummary& summary) const {
  page.heading("Cycle times");
  if (summary.virtual_time) {
    page.text(
        "Virtual time: cycles follow each other as fast as the machine allows, so their times say nothing "
        "about a real-time loop. In real time they are here.");
    return;
  }
  std::vector<report::Row> rows;
  for (const auto& [name, histogram] :
       {std::pair{"wake-up after the deadline", &wake_up_}, {"step", &step_}}) {
    report::Row row{std::string(name)};
    for (const double fraction : {0.5, 0.99, 0.999, 1.0})
      row.emplace_back(hal::microseconds(histogram->quantile(fraction)));
    rows.push_back(std::move(row));
  }
  page.table({{"time"}, {"median", "µs", 1}, {"99 %", "µs", 1}, {"99.9 %", "µs", 1}, {"worst", "µs", 1}},
             rows, fmt::format("{} cycles with a period of {:g} µs", cycles_, 1e6 * period_s_));
  page.plots(
      {{.title = "Wake-up and step",
        .x = time_axis(),
        .y = {"duration", "µs"},
        .series = {times_us_.series("wake-up after the deadline", 0, 1), times_us_.series("step", 1, 1)},
        .spans = spans(summary)},
       {.title = "Cycles that took longer",
        .x = {.label = "duration", .unit = "µs", .log = true},
        .y = {.label = "share of the cycles", .unit = "%", .log = true},
        .series = {slower_than("wake-up after the deadline", wake_up_), slower_than("step", step_)}}});
}

}  // namespace operation
