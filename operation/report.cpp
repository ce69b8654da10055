#include "operation/report.h"

#include <spdlog/fmt/fmt.h>

#include "hal/seconds.h"
#include "runtime/configuration/plausibility_config.h"

namespace operation {
namespace {

using hal::microseconds;
using hal::seconds;

std::string first_motion(const PathMetrics& path) {
  return path.first_motion() ? fmt::format("{:.2f} s", seconds(*path.first_motion())) : "never";
}

std::string quantiles(const drivers::LatencyHistogram& histogram) {
  return fmt::format("median {:.1f} us, 99.9 % {:.1f} us, worst {:.1f} us",
                     microseconds(histogram.quantile(0.5)), microseconds(histogram.quantile(0.999)),
                     microseconds(histogram.worst()));
}

/// Following means to stay, on average and at the end, within a twentieth of the path's 1 m.
bool follows(const PathMetrics& path) {
  constexpr double kClose_m = 0.05;
  return path.first_motion() && path.rms_m() < kClose_m && path.final_m() < kClose_m;
}

std::string verdict(const Summary& without, const Summary& with) {
  if (without.cut_short || with.cut_short) return "The runs were cut short: no verdict.\n";
  const auto words = [](const PathMetrics& path) {
    if (!path.first_motion()) return "never starts";
    return follows(path) ? "follows its path" : "moves, but does not follow its path";
  };
  return fmt::format("With the same gains and limits the base {} without compensation and {} with it.\n",
                     words(without.path), words(with.path));
}

}  // namespace

std::string report_of_any_run(const RunSummary& summary) {
  const runtime::LoopStatistics& loop = summary.loop;
  std::string text = fmt::format("loop         {} cycles", loop.cycles);
  // In virtual time the durations are those of a machine that need not keep up.
  if (summary.virtual_time) {
    text += " in virtual time\n";
  } else {
    const runtime::Disturbances& events = loop.disturbances;
    text += fmt::format(", {} overruns; step {}\nwake-up      {}\n", loop.overruns, quantiles(loop.step),
                        quantiles(loop.wake_up));
    text += fmt::format("memory, CPU  {} page faults (major {}), {} involuntary context switches\n",
                        events.minor_faults + events.major_faults, events.major_faults,
                        events.involuntary_switches);
  }
  text += fmt::format("limiters     cycles: set-point {}, torque rate {}, wall of the workspace {}\n",
                      summary.cycles_setpoint_limited, summary.cycles_torque_rate_limited,
                      summary.cycles_at_wall);
  for (const std::string& line : summary.robot_report) text += fmt::format("robot says   {}\n", line);
  for (const std::string& problem : summary.not_real_time)
    text += fmt::format("NOT REAL-TIME: {}\n", problem);
  for (const std::string& note : runtime::notes_on_silent(summary.once_silent_checks))
    text += fmt::format("NOT CHECKED: {}\n", note);
  if (summary.recorded)
    text += fmt::format("recording    {} cycles written, {} lost\n", summary.cycles_recorded,
                        summary.cycles_lost);
  return text;
}

std::string report(const Summary& summary) {
  const runtime::LoopStatistics& loop = summary.loop;
  const PathMetrics& path = summary.path;
  std::string text = fmt::format("robot        {}, {:.1f} s of robot time in {:.2f} s{}\n", summary.robot,
                                 seconds(loop.robot_time), seconds(loop.wall_time),
                                 summary.virtual_time ? " (virtual time)" : "");
  text += fmt::format("path         first motion: {}; error rms {:.1f} mm, worst {:.1f} mm, {:.3f} rad{}\n",
                      first_motion(path), 1e3 * path.rms_m(), 1e3 * path.worst_m(), path.worst_rad(),
                      path.on_truth() ? " (true pose)" : " (odometry)");
  text += fmt::format("             final error {:.1f} mm, {:.4f} rad; at its limits {:.0f} % of the time\n",
                      1e3 * path.final_m(), path.final_rad(), 100 * path.limited_share());
  if (summary.learned_factors) {
    const std::array<double, 4>& f = *summary.learned_factors;
    text += fmt::format(
        "learned      friction of each wheel over that of its model; to start the next run with it, set\n"
        "             factors = [{:.2f}, {:.2f}, {:.2f}, {:.2f}] in [compensation]\n",
        f[0], f[1], f[2], f[3]);
  }
  return text + report_of_any_run(summary);
}

std::string side_by_side(const std::string& title, const std::string& left_name, const Summary& left_run,
                         const std::string& right_name, const Summary& right_run) {
  std::string text = fmt::format("{:<26}{:>14}{:>14}\n", title, left_name, right_name);
  const auto row = [&text](const char* name, const std::string& left, const std::string& right) {
    text += fmt::format("{:<26}{:>14}{:>14}\n", name, left, right);
  };
  const auto millimetres = [](double metres) { return fmt::format("{:.1f} mm", 1e3 * metres); };
  const auto radians = [](double angle) { return fmt::format("{:.3f} rad", angle); };
  const auto percent = [](double share) { return fmt::format("{:.0f} %", 100 * share); };
  const PathMetrics& a = left_run.path;
  const PathMetrics& b = right_run.path;
  row("first motion", first_motion(a), first_motion(b));
  row("path error, rms", millimetres(a.rms_m()), millimetres(b.rms_m()));
  row("path error, worst", millimetres(a.worst_m()), millimetres(b.worst_m()));
  row("heading error, worst", radians(a.worst_rad()), radians(b.worst_rad()));
  row("final position error", millimetres(a.final_m()), millimetres(b.final_m()));
  row("final heading error", radians(a.final_rad()), radians(b.final_rad()));
  row("at the force limit", percent(a.limited_share()), percent(b.limited_share()));
  return text;
}

std::string compare(const Summary& without, const Summary& with) {
  return side_by_side("friction compensation", "without", without, "with", with) + verdict(without, with);
}

}  // namespace operation
