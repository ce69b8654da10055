#include <spdlog/fmt/fmt.h>

#include <cmath>
#include <map>
#include <string>
#include <vector>

#include "analysis/interval_cells.h"
#include "analysis/robot.h"
#include "identification/gap/noise_draws.h"
#include "report/report.h"
#include "runtime/configuration/quantity.h"
#include "runtime/program/wording.h"

namespace analysis {
namespace {

using identification::robot_gap::FoundPart;
using identification::robot_gap::JointGap;
using identification::robot_gap::RobotResult;
using identification::robot_gap::Share;
using runtime::number_text;

void add_robot_gap(report::Page& page, const RobotResult& result) {
  page.text(
      "The gap is the torque that the model does not predict from the measured motion, rms on held-out "
      "recordings, up to " +
      number_text(result.band_Hz, "Hz") + ". The noise floor is the scatter of torque and position sensors.");
  page.table({{"model"}, {"gap", "N·m"}},
             {{"as given", result.gap_before_Nm},
              {"its friction refitted", result.gap_refitted_Nm},
              {"every parameter fitted at once", result.gap_dense_Nm},
              {"the new one", result.gap_after_Nm},
              {"noise floor", result.noise_floor_Nm}},
             "The gap of all joints");
  std::vector<report::Row> rows;
  for (const JointGap& joint : result.joints) {
    double share = 0;
    for (const Share& one : result.shares)
      if (one.coordinate == "joint" && one.joint == joint.joint) share = one.before;
    rows.push_back({joint.joint, 100 * share, joint.before_Nm, joint.after_Nm, joint.dense_Nm,
                    joint.noise_floor_Nm,
                    joint.noise_floor_Nm > 0 ? joint.after_Nm / joint.noise_floor_Nm : std::nan("")});
  }
  page.table({{"joint"},
              {"of the disagreement", "%", 1},
              {"as given", "N·m"},
              {"new", "N·m"},
              {"every parameter at once", "N·m"},
              {"noise floor", "N·m"},
              {"new, in floors", "", 2}},
             rows, "Where they part, joint by joint");
  rows.clear();
  for (const auto& motion : result.motions)
    rows.push_back({motion.recording, std::string(motion.held_out ? "held out" : "searched"),
                    motion.before_Nm, motion.after_Nm});
  page.table({{"recording"}, {"data"}, {"as given", "N·m"}, {"new", "N·m"}}, rows, "Recording by recording");
}

void add_robot_effects(report::Page& page, const RobotResult& result) {
  if (!result.effects.empty()) {
    page.heading("What was missing");
    std::vector<report::Row> rows;
    std::vector<report::Row> parameters;
    std::vector<report::Row> rivals;
    for (const FoundPart& found : result.effects) {
      rows.push_back({part_words(found.name), found.gap_before_Nm, found.gap_after_Nm,
                      100 * found.held_out_gain, fmt::format("{} of {}", found.blocks_improved, found.blocks),
                      number_text(found.p_value)});
      for (std::size_t i = 0; i < found.parameters.size(); ++i) {
        const auto& estimate = found.parameters[i];
        const runtime::Quantity quantity = runtime::quantity_of(estimate.name);
        const auto [value, lower, upper] = interval_cells(estimate.value, estimate);
        parameters.push_back(
            {part_words(found.name), quantity.name, found.given[i], value, lower, upper, quantity.unit});
      }
      for (std::size_t i = 0; i < found.equivalent.size(); ++i)
        rivals.push_back({part_words(found.name), part_words(found.equivalent[i]),
                          static_cast<double>(found.wins.front()), static_cast<double>(found.wins[i + 1]),
                          i == 0 ? found.deciding_experiment : ""});
    }
    page.table({{"effect"},
                {"without it", "N·m"},
                {"with it", "N·m"},
                {"takes away", "%", 1},
                {"blocks improved"},
                {"by chance p"}},
               rows, "Effects found, on held-out recordings");
    page.table({{"effect"}, {"parameter"}, {"given"}, {"value"}, {"95 %, from"}, {"to"}, {"unit"}},
               parameters, "Their parameters, with intervals from blocks drawn with repetition");
    if (!rivals.empty())
      page.table({{"effect"},
                  {"this data cannot tell it from"},
                  {"wins"},
                  {"wins of the other"},
                  {"what would decide"}},
                 rivals, fmt::format("Rivals, of {} draws of the noise", identification::gap::kNoiseDraws));
  }
  std::vector<report::Row> rows;
  for (const auto& rejected : result.rejected) rows.push_back({part_words(rejected.name), rejected.reason});
  if (!rows.empty()) page.table({{"effect"}, {"why not"}}, rows, "Tried and not added");
}

void add_robot_shares(report::Page& page, const RobotResult& result) {
  if (result.shares.empty()) return;
  page.heading("Where they part");
  page.text(
      "Share of the squared residual of the model as given, in six ranges each: of speed, pose and load of "
      "every joint, in both directions, and over the time of each recording.");
  const std::map<std::string, std::string> units{{"speed", "rad/s"}, {"pose", "rad"}, {"load", "N·m"}};
  for (const auto& [coordinate, unit] : units) {
    std::vector<report::Plot> plots;
    for (const JointGap& joint : result.joints) {
      report::Series before{.name = "as given", .x = {}, .y = {}, .style = report::Style::kLineAndPoints};
      report::Series after{.name = "new", .x = {}, .y = {}, .style = report::Style::kLineAndPoints};
      for (const Share& share : result.shares) {
        if (share.coordinate != coordinate || share.joint != joint.joint) continue;
        for (report::Series* series : {&before, &after}) series->x.push_back(0.5 * (share.from + share.to));
        before.y.push_back(100 * share.before);
        after.y.push_back(100 * share.after);
      }
      if (before.x.empty()) continue;
      plots.push_back({.title = joint.joint + ", by " + coordinate,
                       .x = {coordinate, unit},
                       .y = {"share", "%"},
                       .series = {before, after}});
    }
    if (!plots.empty()) page.plots(plots);
  }
  std::vector<report::Row> rows;
  for (const Share& share : result.shares)
    if (share.coordinate == "direction")
      rows.push_back({share.joint, std::string(share.to > 0.5 ? "forwards" : "backwards"), 100 * share.before,
                      100 * share.after});
    else if (share.coordinate == "time")
      rows.push_back({share.recording, fmt::format("{:.3g} to {:.3g} s", share.from, share.to),
                      100 * share.before, 100 * share.after});
  page.table({{"joint or recording"}, {"range"}, {"as given", "%", 1}, {"new", "%", 1}}, rows,
             "By direction and time");
}

void add_robot_traces(report::Page& page, const RobotResult& result) {
  if (result.traces.empty()) return;
  page.heading("Torques");
  std::string recording;
  std::vector<report::Plot> plots;
  const auto flush = [&] {
    if (!plots.empty()) page.plots(plots);
    plots.clear();
  };
  for (const auto& trace : result.traces) {
    if (trace.recording != recording) flush();
    recording = trace.recording;
    plots.push_back({.title = trace.recording + ", " + trace.joint,
                     .x = {.label = "time", .unit = "s", .link = "time of " + trace.recording},
                     .y = {"torque", "N·m"},
                     .series = {{"measured", trace.time_s, trace.measured_Nm},
                                {"as given", trace.time_s, trace.before_Nm, report::Style::kDashed},
                                {"new", trace.time_s, trace.after_Nm}}});
  }
  flush();
}

}  // namespace

std::string robot_report_html(const RobotFindings& findings) {
  const RobotResult& result = findings.result;
  const std::string name = findings.base.name.empty() ? "the robot" : findings.base.name;
  report::Page page("The gap of " + name);
  page.text(fmt::format("{}: {}.", identification::gap::verdict_name(result.verdict), result.reason));
  for (const FoundPart& found : result.effects)
    if (!found.deciding_experiment.empty()) page.text("Next: " + found.deciding_experiment);
  page.heading("The gap");
  add_robot_gap(page, result);
  add_robot_effects(page, result);
  add_robot_shares(page, result);
  add_robot_traces(page, result);
  for (const std::string& note : result.notes) page.text(note);
  page.heading("Inputs");
  page.text(fmt::format("Model {}; searched {}; held out {}; seed {}.", findings.base_path,
                        runtime::list_text(findings.data), runtime::list_text(result.held_out),
                        findings.seed));
  return page.html();
}

}  // namespace analysis
