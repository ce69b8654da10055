// Experiments that move the joints: stick-slip, compensation, staircase, multisine.
#include <algorithm>
#include <array>
#include <cmath>
#include <string>
#include <vector>

#include "apps/youbot_bench/experiment_findings.h"
#include "apps/youbot_bench/findings_series.h"
#include "runtime/program/wording.h"

namespace youbot_bench {
namespace {

using report::Plot;
using report::Series;

const report::Axis kVelocity{"velocity", "rad/s"};

struct Ends {
  double least = kUnknown;
  double greatest = kUnknown;
  void add(double value) {
    least = std::fmin(least, value);
    greatest = std::fmax(greatest, value);
  }
};

/// Command, velocity and torque over time, stacked, with the range of the joints.
Findings driven_findings(const MeasuredExperiment& measured, bool velocity_commanded) {
  constexpr std::size_t kPoints = 3600;
  const char* const command_name = velocity_commanded ? "velocity_command_rad_per_s" : "torque_command_Nm";
  const report::Axis time{.label = "time", .unit = "s", .link = measured.name};
  Plot command{.title = "Command, the same for all",
               .x = time,
               .y = velocity_commanded ? kVelocity : report::Axis{"torque", "N·m"},
               .series = {}};
  Plot velocity{.title = "Velocity", .x = time, .y = kVelocity, .series = {}};
  Plot torque{.title = "Torque, measured", .x = time, .y = {"torque", "N·m"}, .series = {}};
  Plot displacement{.title = "Displacement", .x = time, .y = {"displacement", "rad"}, .series = {}};
  Findings findings{.table = {.caption = "What the joints reached",
                              .columns = {{"joint"},
                                          {"fastest forward", "rad/s"},
                                          {"fastest backward", "rad/s"},
                                          {"largest torque", "N·m"},
                                          {"smallest torque", "N·m"},
                                          {"travel from the start", "rad"}}}};
  std::vector<double> speeds_rad_per_s;
  for (unsigned look = 0; look < measured.joints.size(); ++look) {
    const MeasuredJoint& joint = measured.joints[look];
    Series commanded{.name = "command", .x = {}, .y = {}};
    Series moved{.name = joint.name, .x = {}, .y = {}, .look = look};
    Series pushed = moved;
    Series turned = moved;
    Ends reached;
    Ends needed;
    double travel_rad = kUnknown;
    double mean_over_s = 0.0;
    for (const Trace& trace : traces(measured, joint, kPoints)) {
      const std::vector<double> time_s = trace.time_s();
      const std::vector<double> velocity_rad_per_s = trace.column("velocity_rad_per_s");
      const std::vector<double> torque_Nm = trace.column("torque_measured_Nm");
      const std::vector<double> displacement_rad = trace.displacement_rad();
      append(commanded, time_s, trace.column(command_name));
      append(moved, time_s, velocity_rad_per_s);
      append(pushed, time_s, torque_Nm);
      append(turned, time_s, displacement_rad);
      for (const double v : velocity_rad_per_s) reached.add(v);
      for (const double t : torque_Nm) needed.add(t);
      travel_rad = displacement_rad.back();
      mean_over_s = std::max(mean_over_s, trace.mean_over_s());
    }
    if (moved.x.empty()) continue;
    if (command.series.empty()) command.series.push_back(commanded);
    velocity.series.push_back(moved);
    torque.series.push_back(pushed);
    displacement.series.push_back(turned);
    velocity.note = torque.note = "Means over " + runtime::number_text(mean_over_s, "s") + ".";
    speeds_rad_per_s.push_back(std::fmax(std::abs(reached.least), std::abs(reached.greatest)));
    findings.table.rows.push_back({joint.name, std::fmax(reached.greatest, 0.0),
                                   std::fmin(reached.least, 0.0), needed.greatest, needed.least, travel_rad});
  }
  findings.title = findings.table.rows.empty() ? "nothing was recorded"
                                               : runtime::list_text(names(measured)) + " reached " +
                                                     runtime::range_text(speeds_rad_per_s, "rad/s");
  findings.plots = {command, velocity, torque, displacement};
  return findings;
}

}  // namespace

Findings stick_slip_findings(const MeasuredExperiment& measured) {
  constexpr std::size_t kPoints = 3600;
  Findings findings{
      .table = {
          .caption = "Slips of each pull",
          .columns = {{"joint"}, {"direction"}, {"slips"}, {"mean slip", "rad"}, {"let go at", "N·m"}}}};
  Plot pull{.title = "Torque of the spring",
            .x = {.label = "time since the pull began", .unit = "s", .link = measured.name},
            .y = {"torque, commanded", "N·m"},
            .series = {}};
  const std::string slow =
      "faster than " + runtime::number_text(measured.setting("slip_speed_rad_per_s", kUnknown), "rad/s");
  std::vector<std::string> slipping;
  std::vector<std::string> holding;
  for (unsigned look = 0; look < measured.joints.size(); ++look) {
    const MeasuredJoint& joint = measured.joints[look];
    const std::vector<double> direction = result(joint, "direction");
    const std::vector<double> slips = result(joint, "slips");
    Series forward{.name = "pulled forward", .x = {}, .y = {}};
    Series backward{.name = "pulled back", .x = {}, .y = {}};
    Series pulled{.name = joint.name, .x = {}, .y = {}, .look = look};
    for (const Trace& trace : traces(measured, joint, kPoints)) {
      append(trace.measurement() % 2 == 0 ? forward : backward, trace.time_s(),
             trace.column("velocity_rad_per_s"));
      append(pulled, trace.time_s(), trace.column("torque_command_Nm"));
    }
    double all_slips = 0.0;
    for (std::size_t i = 0; i < slips.size(); ++i) {
      all_slips += slips[i];
      findings.table.rows.push_back({joint.name, std::string(direction[i] > 0 ? "forward" : "backward"),
                                     slips[i], result(joint, "slip_rad")[i], result(joint, "release_Nm")[i]});
    }
    if (!slips.empty()) (all_slips > 0 ? slipping : holding).push_back(joint.name);
    if (pulled.x.empty()) continue;
    Plot velocity{.title = joint.name,
                  .x = {.label = "time since the pull began", .unit = "s", .link = measured.name},
                  .y = kVelocity,
                  .series = {forward}};
    if (!slips.empty())
      velocity.title +=
          all_slips > 0 ? ": " + runtime::count_text(std::llround(all_slips), "slip") : ": no slip " + slow;
    if (!backward.x.empty()) velocity.series.push_back(backward);
    findings.plots.push_back(velocity);
    pull.series.push_back(pulled);
  }
  findings.plots.push_back(pull);
  if (slipping.empty() && holding.empty())
    findings.title = "Stick-slip: no pull was finished";
  else if (slipping.empty())
    findings.title = "No stick-slip: " + runtime::list_text(holding) + " never " + slow;
  else
    findings.title = "Stick-slip: " + runtime::list_text(slipping) +
                     (slipping.size() == 1 ? " sticks and slips" : " stick and slip") +
                     (holding.empty() ? "" : ", " + runtime::list_text(holding) + " never " + slow);
  return findings;
}

Findings compensation_findings(const MeasuredExperiment& measured) {
  constexpr std::size_t kPoints = 3600;
  Findings findings{.table = {.caption = "Swings after one push",
                              .columns = {{"joint"},
                                          {"friction compensation"},
                                          {"swings"},
                                          {"first swing", "rad"},
                                          {"left at the end", "rad"},
                                          {"passive gain"}}}};
  std::vector<double> gains;
  std::vector<double> swings_without;
  std::vector<double> swings_with;
  for (const MeasuredJoint& joint : measured.joints) {
    Series without{.name = "without", .x = {}, .y = {}, .look = 0};
    Series with{.name = "with compensation", .x = {}, .y = {}, .look = 1};
    for (const Trace& trace : traces(measured, joint, kPoints))
      append(trace.measurement() % 2 == 0 ? without : with, trace.time_s(), trace.displacement_rad());
    const std::vector<double> compensated = result(joint, "compensation");
    const std::vector<double> swings = result(joint, "swings");
    for (std::size_t i = 0; i < swings.size(); ++i)
      findings.table.rows.push_back({joint.name, std::string(compensated[i] > 0 ? "with" : "without"),
                                     swings[i], result(joint, "first_swing_rad")[i],
                                     result(joint, "final_error_rad")[i],
                                     compensated[i] > 0 ? result(joint, "passive_gain")[i] : kUnknown});
    if (!swings.empty()) gains.push_back(result(joint, "passive_gain").front());
    for (const bool is_with : {false, true}) {
      const std::vector<double> those = chosen(swings, compensated, is_with ? 1.0 : 0.0);
      if (those.empty()) continue;
      std::vector<double>& all = is_with ? swings_with : swings_without;
      all.insert(all.end(), those.begin(), those.end());
      const std::string count = runtime::range_text(those);
      (is_with ? with : without).name += ": " + count + (count == "1" ? " swing" : " swings");
    }
    if (without.x.empty()) continue;
    Plot swinging{.title = joint.name + " after a push",
                  .x = {.label = "time since the push", .unit = "s", .link = measured.name},
                  .y = {"displacement", "rad"},
                  .series = {}};
    if (!with.x.empty()) swinging.series.push_back(with);
    swinging.series.push_back(without);  // on top: it ends soon
    findings.plots.push_back(swinging);
  }
  if (swings_without.empty())
    findings.title = "Friction compensation: no measurement was finished";
  else
    findings.title = "Friction compensation: " +
                     (swings_with.empty() ? "not measured yet" : runtime::range_text(swings_with)) +
                     " swings after a push, without it " + runtime::range_text(swings_without);
  findings.remarks.push_back(
      "Each joint is on a spring in software, u = −Kp·(x − xr), pushed once and left "
      "alone. Friction ends the swinging; compensated in full it would never end. Swings "
      "smaller than " +
      runtime::number_text(measured.setting("smallest_swing_rad", kUnknown), "rad") + " are not counted.");
  if (gains.empty()) return findings;
  const bool passive = std::ranges::all_of(gains, [](double gain) { return gain >= 1; });
  findings.remarks.push_back(
      "Passive gain: " + runtime::range_text(gains) +
      " times this help, following the measured speed, brings as much energy as the measured friction of the "
      "joint takes, at the speed where that is least. " +
      (passive ? "The compensated joint is passive: it supplies no energy."
               : "Below 1 the compensated joint is not passive: there the help drives it."));
  return findings;
}

Findings staircase_findings(const MeasuredExperiment& measured) {
  const bool velocity = std::ranges::any_of(
      measured.settings, [](const Setting& s) { return s.key == "quantity" && s.value == "velocity"; });
  Findings findings = driven_findings(measured, velocity);
  findings.title =
      "Staircase of " +
      (velocity ? "velocity up to " + runtime::number_text(measured.setting("highest", kUnknown), "rad/s")
                : "torque up to " + runtime::number_text(measured.setting("highest", kUnknown), "N·m")) +
      ": " + findings.title;
  return findings;
}

Findings reversals_findings(const MeasuredExperiment& measured) {
  Findings findings = driven_findings(measured, true);
  findings.title = "Reversals of velocity up to " +
                   runtime::number_text(measured.setting("highest_rad_per_s", kUnknown), "rad/s") + ": " +
                   findings.title;
  return findings;
}

Findings multisine_findings(const MeasuredExperiment& measured) {
  Findings findings = driven_findings(measured, false);
  findings.title = "Multisine of torque up to " +
                   runtime::number_text(measured.setting("peak_Nm", kUnknown), "N·m") + ": " + findings.title;
  return findings;
}

}  // namespace youbot_bench
