#include "operation/teleop_measures_page.h"

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <string>

#include "hal/seconds.h"
#include "operation/run_page.h"

namespace operation {
namespace {

/// The handle's range within the boundary of rate control, axis by axis.
std::array<double, 3> reach_m(const control::RateBoundary& boundary) {
  const Eigen::Vector3d lowest =
      (boundary.centre_H_m - boundary.half_axes_m)
          .cwiseMax(Eigen::Vector3d(boundary.least_x_m, -std::numeric_limits<double>::infinity(),
                                    boundary.least_z_m));
  const Eigen::Vector3d length = boundary.centre_H_m + boundary.half_axes_m - lowest;
  return {length.x(), length.y(), length.z()};
}

std::string completion(const std::vector<TaskReport>& tasks, const TeleopMeasures& measures) {
  const auto done = std::ranges::count_if(
      tasks, [](const TaskReport& task) { return task.outcome.result == sim::TaskResult::kDone; });
  double whole_s = 0;
  for (const TaskReport& task : tasks) whole_s += hal::seconds(task.outcome.duration);
  if (tasks.empty()) return fmt::format("{:.1f} s", measures.operating_s());
  return fmt::format("{:.1f} s, {} of {} tasks done", whole_s, done, tasks.size());
}

void add_qualities(report::Page& page, const TeleopMeasures& measures, const std::vector<TaskReport>& tasks) {
  const auto force = [&](const TeleopMeasures::End& end) {
    return fmt::format("{:.2f} N² s, {:.2f} N rms", end.force_squared_N2_s, measures.rms_N(end));
  };
  page.table(
      {{"what"}, {"value"}, {"meaning"}},
      {summary_row("completion time", completion(tasks, measures),
                   tasks.empty() ? "while the hand moved the robot" : "of the operator's tasks together"),
       summary_row("peak force, hand", fmt::format("{:.2f} N", measures.hand().largest_force_N),
                   "held by the haptic device"),
       summary_row("peak force, robot", fmt::format("{:.2f} N", measures.robot().largest_force_N),
                   "commanded to the end effector"),
       summary_row("peak force, contact", fmt::format("{:.2f} N", measures.largest_contact_N()),
                   "of the environment on the end effector: true in simulation, else from the arm's torques"),
       summary_row("sum of squared forces, hand", force(measures.hand()), "∫ F² dt"),
       summary_row("sum of squared forces, robot", force(measures.robot()), "∫ F² dt")},
      "Qualitative measures, while the hand moved the robot");
}

/// As set in operation: "10", or "5 to 10" if it was changed.
std::string scale_text(const TeleopMeasures::Range& scale) {
  if (scale.length() > 0) return fmt::format("{:g} to {:g}", scale.lowest, scale.highest);
  return fmt::format("{:g}", scale.lowest);
}

std::string force_ratio(const TeleopMeasures& measures) {
  const double hand_N = measures.hand().largest_force_N;
  return hand_N > 0 ? fmt::format("{:.1f}", measures.robot().largest_force_N / hand_N) : "–";
}

void add_match(report::Page& page, const TeleopMeasures& measures) {
  const std::array<double, 3> whole_m = reach_m(measures.config().mapping.boundary);
  constexpr std::array<const char*, 3> kAxes{"x", "y", "z"};
  std::vector<report::Row> rows;
  for (std::size_t i = 0; i < 3; ++i) {
    const double hand_m = measures.hand().p_m[i].length();
    const double robot_m = measures.robot().p_m[i].length();
    rows.push_back({std::string(kAxes[i]), 1e3 * hand_m, 100 * hand_m / whole_m[i], 1e3 * robot_m,
                    hand_m > 0 ? robot_m / hand_m : std::nan("")});
  }
  page.table({{"axis"},
              {"range of the handle", "mm", 1},
              {"of its range in position control", "%", 0},
              {"range of the end effector", "mm", 1},
              {"end effector over handle", "", 2}},
             rows,
             fmt::format("Match of the workspaces. Position control alone gives {}; rate control gives more. "
                         "Peak force of the robot over that of the hand: {}, scale {}",
                         scale_text(measures.motion_scale()), force_ratio(measures),
                         scale_text(measures.force_scale())));
}

std::string met(bool yes) { return yes ? "met" : "not met"; }

void add_human_limits(report::Page& page, const TeleopMeasures& measures) {
  const double step_N = measures.largest_force_step_N();
  const double stiffness = measures.largest_felt_stiffness_N_per_m();
  const double limit_N = measures.config().feedback.force_limit_N;
  std::vector<report::Row> rows{
      {fmt::format("smooth force: steps below {:g} % of it", 100 * human::kForceShare),
       fmt::format("{:.2g} % of the cycles step further", 100 * measures.rough_share()),
       met(measures.rough_share() == 0), fmt::format("forces above {:g} N", human::kForceResolution_N)},
      {fmt::format("resolution of the force: {:g} N", human::kForceResolution_N),
       fmt::format("largest step of a cycle {:.2g} N", step_N), met(step_N <= human::kForceResolution_N),
       std::string("what a hand can hold")},
      {fmt::format("largest force: {:g} N (finger) to {:g} N (shoulder)", human::kWeakestForce_N,
                   human::kStrongestForce_N),
       fmt::format("limited to {:g} N", limit_N), met(limit_N >= human::kWeakestForce_N),
       std::string("a hand can press harder than the device")},
      {fmt::format("hard objects: {:g} N/cm", 1e-2 * human::kHardStiffness_N_per_m),
       fmt::format("{:.2g} N/cm", 1e-2 * stiffness), met(stiffness >= human::kHardStiffness_N_per_m),
       std::string("stiffness of the coupling over the force scale")}};
  for (const VibrationBand& band : measures.bands()) {
    const double felt_m = human::smallest_felt_vibration_m(band.centre_Hz());
    const bool measured = std::isfinite(band.amplitude_m());
    rows.push_back(
        {fmt::format("vibration around {:.0f} Hz: below {:.2g} µm", band.centre_Hz(), 1e6 * felt_m),
         measured ? fmt::format("{:.2g} µm", 1e6 * band.amplitude_m()) : "too fast for the loop's period",
         measured ? met(band.amplitude_m() < felt_m) : "–",
         std::string(
             "of the handle, an octave, mean over the time; dB of the threshold taken as over 1 µm")});
  }
  page.table({{"human limit"}, {"this teleoperation"}, {"result"}, {"note"}}, rows,
             "Limits of human perception and control. Bandwidth: youbot-bench transparency");
}

}  // namespace

void add_measures(report::Page& page, const TeleopMeasures& measures, const std::vector<TaskReport>& tasks) {
  if (measures.operating_s() == 0) return;
  page.heading("Performance");
  add_measure_tables(page, measures, tasks);
}

void add_measure_tables(report::Page& page, const TeleopMeasures& measures,
                        const std::vector<TaskReport>& tasks) {
  if (measures.operating_s() == 0) return;
  add_qualities(page, measures, tasks);
  add_match(page, measures);
  add_human_limits(page, measures);
}

}  // namespace operation
