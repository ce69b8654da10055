#include <spdlog/fmt/fmt.h>

#include <cmath>

#include "hal/seconds.h"
#include "operation/report.h"

namespace operation {

const char* result_text(sim::TaskResult result) {
  switch (result) {
    case sim::TaskResult::kNotBegun: return "not begun";
    case sim::TaskResult::kUnderWay: return "not finished";
    case sim::TaskResult::kDone: return "done";
    case sim::TaskResult::kTimedOut: return "given up";
  }
  return "";
}

namespace {

using hal::seconds;

std::string line(const TaskReport& task) {
  std::string text = fmt::format("  {:<12} {:<12} {:>5.1f} s   felt up to {:.2f} N", task.name,
                                 result_text(task.outcome.result), seconds(task.outcome.duration),
                                 task.outcome.largest_force_N);
  if (!std::isnan(task.outcome.mean_path_error_m))
    text += fmt::format(", off the path {:.1f} mm on average, {:.1f} mm at most",
                        1e3 * task.outcome.mean_path_error_m, 1e3 * task.outcome.largest_path_error_m);
  return text + "\n";
}

}  // namespace

std::string report(const TeleopSummary& summary) {
  std::string text =
      fmt::format("robot        {}, haptic device {}; {:.1f} s of robot time in {:.2f} s{}\n", summary.robot,
                  summary.master, seconds(summary.loop.robot_time), seconds(summary.loop.wall_time),
                  summary.virtual_time ? " (virtual time)" : "");
  for (const std::string& warning : summary.master_warnings)
    text += fmt::format("device says  {}\n", warning);
  text += "phases      ";
  for (const auto& [phase, begin] : summary.phases)
    text += fmt::format(" {} {:.1f} s,", control::name(phase), seconds(begin));
  text.back() = '\n';
  if (!summary.tasks.empty()) text += "operator\n";
  for (const TaskReport& task : summary.tasks) text += line(task);
  text += fmt::format("hand         force up to {:.2f} N; it was given no more than {:.1f} mJ net\n",
                      summary.largest_grip_force_N, 1e3 * summary.most_energy_given_J);
  text += fmt::format(
      "robot        base up to {:.2f} m from its start; end effector within {:.0f} mm of its set-point\n",
      summary.furthest_base_m, 1e3 * summary.largest_tip_error_m);
  return text + report_of_any_run(summary);
}

}  // namespace operation
