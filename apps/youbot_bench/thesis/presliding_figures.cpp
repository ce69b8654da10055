// Below break-away: torque ramp, Dahl's curve and torques about the stiction border (2.5.2).
#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <string>
#include <vector>

#include "apps/youbot_bench/experiment_findings.h"
#include "apps/youbot_bench/findings_series.h"
#include "apps/youbot_bench/thesis/chapters.h"
#include "apps/youbot_bench/thesis/law_sweep.h"
#include "identification/experiments/dahl.h"
#include "identification/experiments/torque_ramp.h"
#include "identification/experiments/torque_wave.h"
#include "identification/fit/presliding_fit.h"
#include "identification/fit/statistics.h"
#include "runtime/program/wording.h"

namespace youbot_bench::thesis {
namespace {

namespace fits = identification::fit;
using identification::experiments::DahlConfig;
using identification::experiments::presliding_damping_Nm_s_per_rad;
using identification::experiments::presliding_stiffness_Nm_per_rad;
using identification::experiments::PreslidingConfig;
using identification::experiments::TorqueRampConfig;
using report::Plot;
using report::Series;
using report::Style;

const report::Axis kAngle{"displacement", "rad"};
const report::Axis kTorqueAxis{"torque", "N·m"};

constexpr const char* kGivenOffset =
    "The simulated motor was given the printed offset; this is what the sensor shows.";
constexpr const char* kPrintedOnly =
    "From the printed torque and displacement, by the formula of the experiment.";

double mean(const std::vector<double>& values) { return fits::mean_of(values).mean; }

FigureTable table_of(const Findings& findings) {
  return {findings.table.caption, findings.table.columns, findings.table.rows};
}

/// Torque and displacement over time of the first measurement.
std::vector<Plot> over_time(const MeasuredExperiment& measured, const std::string& link) {
  const MeasuredJoint& joint = measured.joints.at(0);
  const std::vector<Trace> all = traces(measured, joint, 3600);
  const Trace& trace = all.at(0);
  const report::Axis time{.label = "time", .unit = "s", .link = link};
  const auto series = [&](const char* name, std::vector<double> y, unsigned look) {
    return Series{.name = name, .x = trace.time_s(), .y = std::move(y), .look = look};
  };
  return {{.title = "Torque",
           .x = time,
           .y = kTorqueAxis,
           .series = {series("commanded", trace.column("torque_command_Nm"), 3),
                      series("of the motor, measured", trace.column("torque_measured_Nm"), 0)}},
          {.title = "Displacement",
           .x = time,
           .y = kAngle,
           .series = {series("encoder", trace.displacement_rad(), 0)}}};
}

/// Mean size of the measured torque while the command is not zero and below 0.02 N·m.
double delivered_below_offset_Nm(const MeasuredExperiment& measured) {
  const MeasuredJoint& joint = measured.joints.at(0);
  const auto command = joint.rows.column("torque_command_Nm");
  const auto torque = joint.rows.column("torque_measured_Nm");
  std::vector<double> sizes;
  for (std::size_t i = 0; i < command.size(); ++i)
    if (std::abs(command[i]) > 1e-4 && std::abs(command[i]) < 0.02) sizes.push_back(std::abs(torque[i]));
  return mean(sizes);
}

Figure ramp_figure(const MeasuredExperiment& measured) {
  Figure figure{.number = "Figure 18",
                .caption = "A slow torque ramp on a motor with an offset",
                .text =
                    "Wheel 1 of the thesis' robot. The motor gives its offset from the first command on, "
                    "and follows the command once that is larger, as printed."};
  figure.compared = {compare("ramp/offset", delivered_below_offset_Nm(measured), kGivenOffset)};
  figure.plots = over_time(measured, "figure 18");
  return figure;
}

/// σ0 = τ1/x1 of the printed torques. The first ramp has the larger ones.
void add_printed_ramps(Figure& figure) {
  const Printed& command = printed("table 5/command");
  const Printed& real = printed("table 5/real");
  const auto add = [&](const char* key, double torque_Nm) {
    figure.compared.push_back(compare(
        key, presliding_stiffness_Nm_per_rad(torque_Nm, printed_value("table 5/step")), kPrintedOnly));
  };
  add("table 5/first, command", command.to);
  add("table 5/first, real", real.to);
  add("table 5/second, command", command.from);
  add("table 5/second, real", real.from);
}

Figure ramp_table(const MeasuredExperiment& offset, const MeasuredExperiment& clean) {
  const MeasuredJoint& joint = offset.joints.at(0);
  const std::vector<double> slopes = result(clean.joints.at(0), "stiffness_slope_Nm_per_rad");
  Figure figure{.number = "Table 5",
                .caption = "First displacement under a torque ramp, and the stiffness from it",
                .text = fmt::format("The first table below is of the thesis' robot, the second one of the "
                                    "same wheels with motors that have no offset. With the offset the "
                                    "experiment shows no stiffness: the first step appears with the first "
                                    "command. Without it the slope over the steps that follow gives {:.0f} "
                                    "N·m/rad, the stiffness of the simulated contact. σ0 = τ1/x1 uses the "
                                    "first step alone, and where in a step of the encoder the wheel rested "
                                    "is not known: the printed values scatter from {:g} to {:g}.",
                                    mean(slopes), printed_value("table 5/second, real"),
                                    printed_value("table 5/first, command"))};
  add_printed_ramps(figure);
  constexpr const char* kStep =
      "One step of an encoder of 4000 ticks behind a gear of 25.838; the thesis prints positions with four "
      "digits.";
  constexpr const char* kAtOnce =
      "The simulated wheel rests without torque before the ramp, so the offset moves it with the first "
      "command. The thesis' wheel moved later; perhaps it rested under the offset already.";
  std::vector<double> steps = magnitudes(result(joint, "first_step_rad"));
  figure.compared.push_back(compare("table 5/step", mean(steps), kStep));
  figure.compared.push_back(
      compare("table 5/command", mean(magnitudes(result(joint, "torque_command_Nm"))), kAtOnce));
  figure.compared.push_back(
      compare("table 5/real", mean(magnitudes(result(joint, "torque_measured_Nm"))),
              "As above, and the low-pass of the measured torque has not settled yet."));
  figure.compared.push_back(compare(
      "ramp/stiffness", mean(slopes),
      "Without the offset. The simulated contact was given the thesis' choice; the experiment estimates it "
      "from encoder steps and measured torques, and could miss it."));
  figure.compared.push_back(compare(
      "ramp/damping",
      presliding_damping_Nm_s_per_rad(implied_inertia_kg_m2(), printed_value("ramp/stiffness")),
      fmt::format("With J = {:.3g} kg·m², which follows from the printed number: about the wheel alone. With "
                  "the rotor through the gear J is 1.06e-2 kg·m² and σ1 = 0.33 N·m·s/rad.",
                  implied_inertia_kg_m2())));
  figure.tables = {table_of(torque_ramp_findings(offset)), table_of(torque_ramp_findings(clean))};
  return figure;
}

Figure theoretical_dahl_curve(const MeasuredExperiment& clean) {
  const Findings findings = dahl_findings(clean);
  const double stiffness = mean(result(clean.joints.at(0), "stiffness_command_Nm_per_rad"));
  Figure figure{.number = "Figure 19",
                .caption = "Shape of Dahl's curve: torque over displacement below break-away",
                .text =
                    "The experiment as it should be: wheel 1 without the motor's offset, a sine of torque "
                    "below break-away. The thesis' figure is another author's. The simulated contact is "
                    "straight until it breaks away, so the loop is a line with the steps of the encoder; "
                    "with LuGre's law it is the narrow loop of the last plot."};
  figure.compared = {compare("dahl/stiffness", stiffness,
                             "A loop of few encoder steps: the interval in the table is that of their "
                             "edges. The simulated contact has the stiffness that the thesis took from its "
                             "ramp; the slope is estimated and could miss it.")};
  figure.tables = {table_of(findings)};
  figure.plots = findings.plots;
  constexpr std::array<double, 6> kTurns_rad{0, 2e-4, -2e-4, 2e-4, -2e-4, 2e-4};
  const LawSweep swept = through(model::friction::make_law("lugre"), kTurns_rad, 1e-3, 1e-3);
  figure.plots.push_back({.title = "LuGre's law between ±2e-4 rad",
                          .x = kAngle,
                          .y = kTorqueAxis,
                          .series = {{"lugre", swept.position_rad, swept.torque_Nm}}});
  return figure;
}

/// The torque of the motor has the sign of the command; the sensor does not report it. After the first cycle.
Plot loop_of_motor(const MeasuredExperiment& measured) {
  const identification::Recording& rows = measured.joints.at(0).rows;
  const auto time_s = rows.column("time_s");
  const auto position = rows.column("position_rad");
  const auto command = rows.column("torque_command_Nm");
  const auto torque = rows.column("torque_measured_Nm");
  const double settled_s =
      time_s[0] + measured.setting("rest_s", 2) + 1 / measured.setting("frequency_Hz", 0.1);
  Series loop{.name = "of the motor, with the sign of the command", .x = {}, .y = {}};
  for (std::size_t i = 0; i < time_s.size(); i += 10) {
    if (time_s[i] < settled_s) continue;
    loop.x.push_back(position[i] - position[0]);
    loop.y.push_back(std::copysign(torque[i], command[i]));
  }
  return {.title = "Torque of the motor over displacement", .x = kAngle, .y = kTorqueAxis, .series = {loop}};
}

Figure spoiled_dahl_curve(const MeasuredExperiment& offset) {
  const Findings findings = dahl_findings(offset);
  const MeasuredJoint& joint = offset.joints.at(0);
  const double lowest = mean(result(joint, "lowest_displacement_rad"));
  const double highest = mean(result(joint, "highest_displacement_rad"));
  Figure figure{
      .number = "Figure 20",
      .caption = "Dahl's curve as the youBot shows it",
      .text =
          "The same experiment on the thesis' robot: about zero the motor gives its offset with either sign, "
          "and the centre of the loop becomes a rectangle, as printed. The sensor reports the current "
          "without its sign; "
          "the first plot gives it that of the command, as the thesis' plot has it."};
  figure.compared = {compare("dahl/cycles", offset.setting("cycles", kUnknown)),
                     compare("dahl/offset", delivered_below_offset_Nm(offset), kGivenOffset),
                     compare("dahl/displacement", highest - lowest)};
  figure.text += " " + findings.title + ".";
  figure.tables = {table_of(findings)};
  figure.plots = {loop_of_motor(offset)};
  figure.plots.insert(figure.plots.end(), findings.plots.begin(), findings.plots.end());
  return figure;
}

/// The fit of figures 21 and 22 to the recording of figure 23.
FigureTable dynamic_fit(const MeasuredExperiment& measured) {
  const model::friction::Kfm::Parameters table_4;
  const fits::PreslidingFit fit = fits::fit_presliding(
      measured.joints.at(0).rows, {.inertia_kg_m2 = implied_inertia_kg_m2(), .sliding = table_4});
  FigureTable table{.caption = "Fit of LuGre's σ0 and σ1 to this recording (figures 21 and 22)",
                    .columns = {{"parameter"}, {"value"}, {"95 %, from"}, {"to"}, {"why there is no number"}},
                    .rows = {}};
  for (const fits::Estimate& estimate : fit.parameters) {
    const bool ok = estimate.ok();
    table.rows.push_back({estimate.title(), ok ? estimate.value : kUnknown, ok ? estimate.lower : kUnknown,
                          ok ? estimate.upper : kUnknown, estimate.not_identifiable});
  }
  for (const std::string& verdict : fit.verdicts)
    table.rows.push_back({std::string("verdict"), kUnknown, kUnknown, kUnknown, verdict});
  return table;
}

Figure centred_torque(const Workshop& workshop) {
  const MeasuredExperiment measured =
      workshop.measure("figure-23", workshop.thesis_robot(),
                       PreslidingConfig{.waveform = "sine", .peak_Nm = 0.045}, "wheel-1");
  Figure figure{
      .number = "Figure 23",
      .caption = "A torque centred on zero, and the position",
      .text =
          "Wheel 1 of the thesis' robot. The motor's offset replaces the small torques, and the position "
          "jumps where the command changes its sign: the part of the experiment that shows σ0 and σ1 is "
          "lost, as printed, and the fit refuses the recording."};
  figure.plots = over_time(measured, "figure 23");
  figure.tables = {dynamic_fit(measured)};
  return figure;
}

Figure positive_torque(const Workshop& workshop) {
  // Above the offset all the time, up to the break-away of the law.
  const PreslidingConfig towards{.waveform = "sine", .peak_Nm = 0.025, .offset_Nm = 0.06};
  const MeasuredExperiment creeping =
      workshop.measure("figure-24", workshop.robot_with_law("lugre"), towards, "wheel-1");
  const MeasuredExperiment sticking =
      workshop.measure("figure-24-elastic", workshop.robot_without_offset(),
                       PreslidingConfig{.waveform = "sine", .peak_Nm = 0.02, .offset_Nm = 0.045}, "wheel-1");
  const auto creep = [](const MeasuredExperiment& measured) {
    return mean(result(measured.joints.at(0), "creep_per_period_rad"));
  };
  Figure figure{
      .number = "Figure 24",
      .caption = "A positive torque at the border of stiction: minima that creep",
      .text = fmt::format(
          "Torque around 0.06 N·m with 0.025 N·m to both sides, above the motor's offset all the time, "
          "which is therefore left out. The wheel has LuGre's law with table 4, the model that the thesis "
          "selected: its state slips a little under any load, and the minima rise by {:.2g} rad a period. "
          "A contact that is elastic until it breaks away (the thesis' robot of the other figures) gives "
          "{:.2g}: it cannot creep. That the position falls with the torque is the spring of the contact; "
          "the thesis suspected magnetic fields or vibration.",
          creep(creeping), creep(sticking))};
  figure.compared = {
      compare("creep", creep(creeping),
              "The thesis gives the direction, not the size; LuGre's size follows from its values.")};
  figure.plots = over_time(creeping, "figure 24");
  return figure;
}

}  // namespace

std::vector<Figure> presliding(const Workshop& workshop) {
  const Wheels clean = workshop.robot_without_offset();
  const TorqueRampConfig ramp{.inertia_kg_m2 = implied_inertia_kg_m2(), .repeats = 1};
  const MeasuredExperiment ramps = workshop.measure("figure-18", workshop.thesis_robot(), ramp, "wheel-1");
  const MeasuredExperiment clean_ramps = workshop.measure("table-5", clean, ramp, "wheel-1");
  std::vector<Figure> figures{ramp_figure(ramps), ramp_table(ramps, clean_ramps)};
  figures.push_back(theoretical_dahl_curve(workshop.measure("figure-19", clean, DahlConfig{}, "wheel-1")));
  figures.push_back(
      spoiled_dahl_curve(workshop.measure("figure-20", workshop.thesis_robot(), DahlConfig{}, "wheel-1")));
  figures.push_back(centred_torque(workshop));
  figures.push_back(positive_torque(workshop));
  return figures;
}

}  // namespace youbot_bench::thesis
