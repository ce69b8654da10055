// Experiments below and up to breakaway: torque ramp, Dahl's loop, presliding waves.
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <string>
#include <vector>

#include "apps/youbot_bench/experiment_findings.h"
#include "apps/youbot_bench/findings_series.h"
#include "identification/fit/statistics.h"
#include "runtime/program/wording.h"

namespace youbot_bench {
namespace {

using report::Plot;
using report::Series;
using report::Style;

const report::Axis kDisplacement{"displacement", "rad"};
const report::Axis kTorque{"torque", "N·m"};

/// Up to the first point at which the ramp is above breakaway; all points if it never is.
std::size_t points_before(const std::vector<double>& command_Nm, double breakaway_Nm) {
  if (!std::isfinite(breakaway_Nm)) return command_Nm.size();
  const auto beyond = std::ranges::find_if(
      command_Nm, [&](double torque_Nm) { return std::abs(torque_Nm) > std::abs(breakaway_Nm); });
  return static_cast<std::size_t>(beyond - command_Nm.begin());
}

template <typename Values>
std::vector<double> first_of(const Values& values, std::size_t count) {
  return {values.begin(), values.begin() + static_cast<std::ptrdiff_t>(std::min(count, values.size()))};
}

/// Of torques or stiffnesses as measured, from those as commanded; far more than current noise.
constexpr double kFarApart = 0.1;
/// Encoder steps from which identify fits a contact (identification/fit/presliding_fit.h).
constexpr double kFineSteps = 20;

/// Straight through the origin, over `reach_rad` to both sides.
Series slope(const std::string& name, double stiffness_Nm_per_rad, double reach_rad, unsigned look) {
  return {.name = name,
          .x = {-reach_rad, reach_rad},
          .y = {-reach_rad * stiffness_Nm_per_rad, reach_rad * stiffness_Nm_per_rad},
          .style = Style::kDashed,
          .look = look};
}

}  // namespace

Findings torque_ramp_findings(const MeasuredExperiment& measured) {
  constexpr std::size_t kPoints = 3600;
  constexpr double kSlopeReachSteps = 5;
  constexpr double kShownSteps = 10;  // of the encoder: slightly more than any joint's displacement before it
                                      // slides
  Plot torque{.title = "Torque",
              .x = {.label = "time since the ramp began", .unit = "s", .link = measured.name},
              .y = {"torque, measured", "N·m"},
              .series = {}};
  Plot displacement{.title = "Displacement",
                    .x = {.label = "time since the ramp began", .unit = "s", .link = measured.name},
                    .y = kDisplacement,
                    .series = {}};
  Plot presliding{.title = "Before it breaks away a joint yields like a spring",
                  .x = kDisplacement,
                  .y = {"torque, commanded", "N·m"},
                  .series = {},
                  .note = "The steps are those of the encoder. Dashed: σ0 by slope."};
  Findings findings{.table = {.caption = "Break-away and pre-sliding, means over the ramps of one direction",
                              .columns = {{"joint"},
                                          {"direction"},
                                          {"ramps"},
                                          {"break-away", "N·m"},
                                          {"±\u00a095\u00a0%", "N·m"},
                                          {"as measured", "N·m"},
                                          {"x1", "rad"},
                                          {"τ1", "N·m"},
                                          {"σ0 = τ1/x1", "N·m/rad"},
                                          {"σ0 by slope", "N·m/rad"},
                                          {"±\u00a095\u00a0%", "N·m/rad"},
                                          {"σ1", "N·m·s/rad"}}}};
  Series broke_at{.name = "break-away", .x = {}, .y = {}, .style = Style::kPoints, .look = kInk};
  Series broke_when = broke_at;
  std::vector<double> breakaways_Nm;
  std::vector<double> steps_rad;
  bool all_held = true;
  std::vector<std::string> spoiled;
  for (unsigned look = 0; look < measured.joints.size(); ++look) {
    const MeasuredJoint& joint = measured.joints[look];
    const std::vector<double> breakaway_Nm = result(joint, "breakaway_command_Nm");
    Series driven{.name = joint.name, .x = {}, .y = {}, .look = look};
    Series moved = driven;
    Series loop = driven;
    for (const Trace& trace : traces(measured, joint, kPoints)) {
      const std::vector<double> time_s = trace.time_s();
      const std::vector<double> command_Nm = trace.column("torque_command_Nm");
      const std::vector<double> displacement_rad = trace.displacement_rad();
      append(driven, time_s, trace.column("torque_measured_Nm"));
      append(moved, time_s, displacement_rad);
      const double broke_Nm =
          trace.measurement() < breakaway_Nm.size() ? breakaway_Nm[trace.measurement()] : kUnknown;
      const std::size_t before = points_before(command_Nm, broke_Nm);
      append(loop, first_of(displacement_rad, before), first_of(command_Nm, before));
      if (std::isfinite(broke_Nm) && before > 0) {
        append(broke_at, {time_s[before - 1]}, {broke_Nm});
        append(broke_when, {time_s[before - 1]}, {displacement_rad[before - 1]});
      }
    }
    if (!driven.x.empty()) {
      torque.series.push_back(driven);
      displacement.series.push_back(moved);
      presliding.series.push_back(loop);
    }
    const double stiffness = identification::fit::mean_of(result(joint, "stiffness_slope_Nm_per_rad")).mean;
    const double step_rad = identification::fit::mean_of(magnitudes(result(joint, "first_step_rad"))).mean;
    if (std::isfinite(stiffness)) {
      presliding.series.push_back(slope("", stiffness, kSlopeReachSteps * step_rad, look));
      steps_rad.push_back(step_rad);
    }
    for (const double direction : {1.0, -1.0}) {
      const auto those = [&](const char* name) {
        return chosen(result(joint, name), result(joint, "direction"), direction);
      };
      const std::vector<double> ramps = those("direction");
      if (ramps.empty()) continue;
      const identification::fit::MeanOf breakaway =
          identification::fit::mean_of(those("breakaway_command_Nm"));
      all_held = all_held && breakaway.values < 1;
      const identification::fit::MeanOf slope_of =
          identification::fit::mean_of(those("stiffness_slope_Nm_per_rad"));
      const double at_first_Nm = identification::fit::mean_of(those("torque_command_Nm")).mean;
      const double beyond_Nm =  // a sensor may report magnitudes
          std::abs(std::abs(identification::fit::mean_of(those("torque_measured_Nm")).mean) -
                   std::abs(at_first_Nm));
      if (beyond_Nm > kFarApart * std::max(std::abs(at_first_Nm), std::abs(breakaway.mean)) &&
          (spoiled.empty() || spoiled.back() != joint.name))
        spoiled.push_back(joint.name);
      breakaways_Nm.push_back(std::abs(breakaway.mean));
      findings.table.rows.push_back(
          {joint.name, std::string(direction > 0 ? "forward" : "backward"), static_cast<double>(ramps.size()),
           breakaway.mean, breakaway.ci95, identification::fit::mean_of(those("breakaway_measured_Nm")).mean,
           identification::fit::mean_of(those("first_step_rad")).mean, at_first_Nm,
           identification::fit::mean_of(those("stiffness_command_Nm_per_rad")).mean, slope_of.mean,
           slope_of.ci95, identification::fit::mean_of(those("damping_command_Nm_s_per_rad")).mean});
    }
  }
  if (!broke_at.x.empty()) {
    torque.title = "The torque rises until the joint breaks away";
    torque.series.push_back(broke_at);
    displacement.title = "It creeps, then breaks away";
    displacement.series.push_back(broke_when);
  }
  if (!steps_rad.empty()) {
    presliding.x.to = kShownSteps * *std::ranges::max_element(steps_rad);
    presliding.x.from = -*presliding.x.to;
  }
  if (findings.table.rows.empty())
    findings.title = "Torque ramp: no ramp was finished";
  else if (all_held)
    findings.title = "Torque ramp: nothing broke away up to " +
                     runtime::number_text(measured.setting("highest_torque_Nm", kUnknown), "N·m");
  else
    findings.title = "Torque ramp: " + runtime::list_text(names(measured)) +
                     (measured.joints.size() == 1 ? " breaks" : " break") + " away at " +
                     runtime::range_text(breakaways_Nm, "N·m");
  if (!findings.table.rows.empty())
    findings.remarks.emplace_back(
        "Break-away is the torque command at the last moment at which the joint did not slide yet. x1 is its "
        "first step and τ1 the command at which it appeared. Where in a step of its encoder the joint rested "
        "is not known, so σ0 = τ1/x1 is less than the stiffness by an unknown share; the slope over the "
        "steps "
        "that follow is free of that. Its interval is that of the scatter between ramps. σ1 = 0.2·√(J·σ0).");
  if (!spoiled.empty())
    findings.remarks.push_back("The torque of " + runtime::list_text(spoiled) +
                               " as measured at the first step differs from the command by more than 10 % of "
                               "the break-away: the motors do not deliver what small commands ask for, so "
                               "neither σ0 nor σ1 is the joint's.");
  findings.plots = {torque, displacement, presliding};
  return findings;
}

Findings dahl_findings(const MeasuredExperiment& measured) {
  constexpr std::size_t kPoints = 3600;
  const double settled_s = 1 / measured.setting("frequency_Hz", 0.1);
  Findings findings{.table = {.caption = "Stiffness at the centre of the loop",
                              .columns = {{"joint"},
                                          {"run"},
                                          {"σ0, torque as commanded", "N·m/rad"},
                                          {"±\u00a095\u00a0%", "N·m/rad"},
                                          {"σ0, torque as measured", "N·m/rad"},
                                          {"±\u00a095\u00a0%", "N·m/rad"},
                                          {"encoder steps"},
                                          {"lowest displacement", "rad"},
                                          {"highest", "rad"}}}};
  std::vector<double> stiffnesses;
  std::vector<std::string> spoiled;
  std::vector<std::string> coarse;
  for (const MeasuredJoint& joint : measured.joints) {
    Series commanded{.name = "as commanded", .x = {}, .y = {}, .look = 0};
    Series as_measured{.name = "as measured", .x = {}, .y = {}, .look = 1};
    double reach_rad = 0.0;
    for (const Trace& trace : traces(measured, joint, kPoints)) {
      const std::vector<double> time_s = trace.time_s();
      const auto settled =
          static_cast<std::size_t>(std::ranges::lower_bound(time_s, settled_s) - time_s.begin());
      const auto later = [settled](const std::vector<double>& values) {
        return std::vector<double>(values.begin() + static_cast<std::ptrdiff_t>(settled), values.end());
      };
      const std::vector<double> displacement_rad = later(trace.displacement_rad());
      append(commanded, displacement_rad, later(trace.column("torque_command_Nm")));
      append(as_measured, displacement_rad, later(trace.column("torque_measured_Nm")));
      for (const double x_rad : displacement_rad) reach_rad = std::max(reach_rad, std::abs(x_rad));
    }
    const std::vector<double> by_command = result(joint, "stiffness_command_Nm_per_rad");
    const std::vector<double> by_measured = result(joint, "stiffness_measured_Nm_per_rad");
    const std::vector<double> interval = result(joint, "stiffness_command_ci95_Nm_per_rad");
    const std::vector<double> steps = result(joint, "encoder_steps");
    if (std::ranges::any_of(steps, [](double count) { return count < kFineSteps; }))
      coarse.push_back(joint.name);
    const double stiffness = identification::fit::mean_of(by_command).mean;
    stiffnesses.push_back(stiffness);
    if (std::abs(identification::fit::mean_of(by_measured).mean - stiffness) >
        kFarApart * std::abs(stiffness))
      spoiled.push_back(joint.name);
    for (std::size_t i = 0; i < by_command.size(); ++i)
      findings.table.rows.push_back({joint.name, static_cast<double>(i + 1), by_command[i], interval[i],
                                     by_measured[i], result(joint, "stiffness_measured_ci95_Nm_per_rad")[i],
                                     steps[i], result(joint, "lowest_displacement_rad")[i],
                                     result(joint, "highest_displacement_rad")[i]});
    if (commanded.x.empty()) continue;
    Plot loop{.title = joint.name + ": torque against displacement",
              .x = kDisplacement,
              .y = kTorque,
              .series = {as_measured, commanded}};
    if (std::isfinite(stiffness)) {
      const double amplitude_Nm = measured.setting("amplitude_Nm", reach_rad * stiffness);
      loop.title = joint.name + ": σ0 = " + runtime::number_text(stiffness);
      if (by_command.size() == 1 && std::isfinite(interval[0]))
        loop.title += " ± " + runtime::number_text(interval[0]);
      loop.title += " N·m/rad";
      loop.series.push_back(
          slope("slope at the centre", stiffness, std::min(reach_rad, amplitude_Nm / stiffness), kInk));
    }
    findings.plots.push_back(loop);
  }
  const std::string range = runtime::range_text(stiffnesses, "N·m/rad");
  if (findings.table.rows.empty())
    findings.title = "Dahl's loop: no measurement was finished";
  else if (!spoiled.empty())
    findings.title = "Dahl's loop: no stiffness of " + runtime::list_text(spoiled) +
                     ": the torque as measured does not follow the command";
  else
    findings.title =
        "Dahl's loop: pre-sliding stiffness of " + runtime::list_text(names(measured)) + " is " + range;
  if (!findings.plots.empty())
    findings.remarks.emplace_back("The loops are those of all cycles after the first, which only settles.");
  if (!coarse.empty())
    findings.remarks.push_back(
        "The loop of " + runtime::list_text(coarse) + " is fewer than " + runtime::number_text(kFineSteps) +
        " encoder steps high. The slope is that between the edges of steps, and few edges leave a wide "
        "interval; identify needs " +
        runtime::number_text(kFineSteps) + " steps for the other parameters of the contact.");
  if (!spoiled.empty())
    findings.remarks.push_back(
        "The torque as commanded and as measured give stiffnesses that differ by more than 10 % for " +
        runtime::list_text(spoiled) +
        ": the motors do not deliver what small commands ask for, or the sensor reports no sign. Unless it "
        "is "
        "the sensor, neither number is the stiffness.");
  return findings;
}

Findings presliding_findings(const MeasuredExperiment& measured) {
  constexpr std::size_t kPoints = 3600;
  constexpr double kCameBack = 0.5;  // of the largest displacement; a spring returns no more
  Plot torque{.title = "Torque, the same for all",
              .x = {.label = "time", .unit = "s", .link = measured.name},
              .y = kTorque,
              .series = {}};
  Plot motion{.title = "Displacement",
              .x = {.label = "time", .unit = "s", .link = measured.name},
              .y = kDisplacement,
              .series = {}};
  Findings findings{
      .table = {.caption = "How far the torque moved the joints",
                .columns = {{"joint"}, {"run"}, {"largest displacement", "rad"}, {"at the end", "rad"}}}};
  const bool swings_to_one_side = measured.setting("offset_Nm", 0) != 0;
  if (swings_to_one_side) findings.table.columns.push_back({"minima move on", "rad a period"});
  std::vector<double> largest_rad;
  std::vector<double> creeps_rad;
  std::vector<std::string> slid;
  std::vector<Plot> loops;
  for (unsigned look = 0; look < measured.joints.size(); ++look) {
    const MeasuredJoint& joint = measured.joints[look];
    Series loop{.name = "torque as commanded", .x = {}, .y = {}};
    Series moved{.name = joint.name, .x = {}, .y = {}, .look = look};
    Series driven{.name = "command", .x = {}, .y = {}};
    for (const Trace& trace : traces(measured, joint, kPoints)) {
      append(loop, trace.displacement_rad(), trace.column("torque_command_Nm"));
      append(moved, trace.time_s(), trace.displacement_rad());
      append(driven, trace.time_s(), trace.column("torque_command_Nm"));
    }
    const std::vector<double> farthest_rad = result(joint, "largest_displacement_rad");
    const std::vector<double> last_rad = result(joint, "last_displacement_rad");
    const std::vector<double> creep_rad =
        swings_to_one_side ? result(joint, "creep_per_period_rad") : std::vector<double>{};
    bool slides = false;
    for (std::size_t i = 0; i < farthest_rad.size(); ++i) {
      slides = slides || (!swings_to_one_side && std::abs(last_rad[i]) > kCameBack * farthest_rad[i]);
      findings.table.rows.push_back({joint.name, static_cast<double>(i + 1), farthest_rad[i], last_rad[i]});
      if (swings_to_one_side) findings.table.rows.back().push_back(creep_rad[i]);
    }
    creeps_rad.insert(creeps_rad.end(), creep_rad.begin(), creep_rad.end());
    largest_rad.insert(largest_rad.end(), farthest_rad.begin(), farthest_rad.end());
    if (slides) slid.push_back(joint.name);
    if (loop.x.empty()) continue;
    motion.series.push_back(moved);
    if (torque.series.empty()) torque.series.push_back(driven);
    loops.push_back({.title = joint.name + (swings_to_one_side ? ""
                                            : slides           ? " slid"
                                                               : " came back"),
                     .x = kDisplacement,
                     .y = kTorque,
                     .series = {loop}});
  }
  if (findings.table.rows.empty())
    findings.title = "Pre-sliding: no measurement was finished";
  else if (swings_to_one_side)
    findings.title = "Pre-sliding: the minima of " + runtime::list_text(names(measured)) + " moved on by " +
                     runtime::range_text(creeps_rad, "rad") + " a period";
  else if (slid.empty())
    findings.title = "Pre-sliding: " + runtime::list_text(names(measured)) + " moved by " +
                     runtime::range_text(largest_rad, "rad") + " at most and came back";
  else
    findings.title = "Pre-sliding: " + runtime::list_text(slid) + " did not come back";
  if (!slid.empty())
    findings.remarks.push_back("The torque was more than " + runtime::list_text(slid) +
                               " withstood without sliding. Measure again with a lower peak.");
  findings.plots = {torque, motion};
  findings.plots.insert(findings.plots.end(), loops.begin(), loops.end());
  return findings;
}

}  // namespace youbot_bench
