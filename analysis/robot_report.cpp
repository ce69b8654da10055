#include <spdlog/fmt/fmt.h>

#include <cmath>
#include <map>
#include <numbers>
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

using identification::robot_gap::ChannelGap;
using identification::robot_gap::FoundPart;
using identification::robot_gap::RobotResult;
using identification::robot_gap::Share;
using runtime::number_text;

void add_robot_gap(report::Page& page, const RobotFindings& findings) {
  const RobotResult& result = findings.result;
  page.text(findings.comparison);
  std::vector<report::Row> rows;
  for (const auto& [unit, gap] : result.gaps) {
    rows = {{"as given", gap.before}};
    // A robot that is given without friction has none to refit.
    if (gap.refitted != gap.before) rows.push_back({"its friction refitted", gap.refitted});
    rows.push_back({"every parameter fitted at once", gap.dense});
    rows.push_back({"the new one", gap.after});
    rows.push_back({"noise floor", gap.noise_floor});
    page.table({{"model"}, {"gap", unit}}, rows,
               fmt::format("The gap of all {}s, in {}", findings.channel_word, unit));
  }
  rows.clear();
  for (const ChannelGap& channel : result.channels) {
    double share = 0;
    for (const Share& one : result.shares)
      if (one.coordinate == "channel" && one.channel == channel.channel.name) share = one.before;
    const auto& gap = channel.gap;
    rows.push_back({channel.channel.name, 100 * share, gap.before, gap.after, gap.dense, gap.noise_floor,
                    channel.channel.unit, gap.noise_floor > 0 ? gap.after / gap.noise_floor : std::nan("")});
  }
  page.table({{findings.channel_word},
              {"of the disagreement", "%", 1},
              {"as given"},
              {"new"},
              {"every parameter at once"},
              {"noise floor"},
              {"unit"},
              {"new, in floors", "", 2}},
             rows, fmt::format("Where they part, {0} by {0}", findings.channel_word));
  rows.clear();
  for (const auto& motion : result.motions)
    rows.push_back({motion.recording, std::string(motion.held_out ? "held out" : "searched"), motion.before,
                    motion.after});
  page.table({{"recording"}, {"data"}, {"as given", "floors"}, {"new", "floors"}}, rows,
             "Recording by recording, in noise floors");
}

/// "0.1 N·m, 2 rad"
std::string by_unit(const std::vector<double>& values, const RobotResult& result) {
  std::string text;
  for (std::size_t u = 0; u < result.gaps.size(); ++u)
    text += (text.empty() ? "" : ", ") + number_text(values[u], result.gaps[u].unit);
  return text;
}

void add_robot_effects(report::Page& page, const RobotResult& result) {
  if (!result.effects.empty()) {
    page.heading("What was missing");
    std::vector<report::Row> rows;
    std::vector<report::Row> parameters;
    std::vector<report::Row> rivals;
    for (const FoundPart& found : result.effects) {
      rows.push_back({part_words(found.name), by_unit(found.gap_before, result),
                      by_unit(found.gap_after, result), 100 * found.held_out_gain,
                      fmt::format("{} of {}", found.blocks_improved, found.blocks),
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
                {"gap without it"},
                {"with it"},
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

/// A plot of each channel, for every coordinate with more than two ranges.
void add_robot_share_plots(report::Page& page, const RobotResult& result) {
  std::map<std::string, std::map<std::string, report::Plot>> plots;
  for (const Share& share : result.shares) {
    if (share.coordinate == "channel" || share.coordinate == "time" || share.coordinate == "direction")
      continue;
    const std::string of = share.channel.empty() ? "" : share.channel + ", ";
    report::Plot& plot = plots[share.coordinate][share.channel];
    if (plot.series.empty())
      plot = {.title = of + "by " + share.coordinate,
              .x = {share.coordinate, share.unit},
              .y = {"share", "%"},
              .series = {{.name = "as given", .x = {}, .y = {}, .style = report::Style::kLineAndPoints},
                         {.name = "new", .x = {}, .y = {}, .style = report::Style::kLineAndPoints}}};
    for (report::Series& series : plot.series) series.x.push_back(0.5 * (share.from + share.to));
    plot.series[0].y.push_back(100 * share.before);
    plot.series[1].y.push_back(100 * share.after);
  }
  for (const auto& [coordinate, by_channel] : plots) {
    std::vector<report::Plot> row;
    for (const auto& [channel, plot] : by_channel) row.push_back(plot);
    page.plots(row);
  }
}

void add_robot_shares(report::Page& page, const RobotFindings& findings) {
  const RobotResult& result = findings.result;
  if (result.shares.empty()) return;
  page.heading("Where they part");
  page.text(
      "Share of the squared residual of the model as given, in ranges of each quantity and over the time of "
      "each recording.");
  add_robot_share_plots(page, result);
  std::vector<report::Row> rows;
  for (const Share& share : result.shares)
    if (share.coordinate == "direction")
      rows.push_back({share.channel, std::string(share.to > 0.5 ? "forwards" : "backwards"),
                      100 * share.before, 100 * share.after});
    else if (share.coordinate == "time")
      rows.push_back({share.recording, fmt::format("{:.3g} to {:.3g} s", share.from, share.to),
                      100 * share.before, 100 * share.after});
  page.table({{findings.channel_word + " or recording"}, {"range"}, {"as given", "%", 1}, {"new", "%", 1}},
             rows, "By direction and time");
}

void add_robot_traces(report::Page& page, const RobotResult& result) {
  if (result.traces.empty()) return;
  page.heading("Measured and predicted");
  std::string recording;
  std::vector<report::Plot> plots;
  const auto flush = [&] {
    if (!plots.empty()) page.plots(plots);
    plots.clear();
  };
  for (const auto& trace : result.traces) {
    if (trace.recording != recording) flush();
    recording = trace.recording;
    plots.push_back({.title = trace.recording + ", " + trace.channel,
                     .x = {.label = "time", .unit = "s", .link = "time of " + trace.recording},
                     .y = {trace.channel, trace.unit},
                     .series = {{"measured", trace.time_s, trace.measured},
                                {"as given", trace.time_s, trace.before, report::Style::kDashed},
                                {"new", trace.time_s, trace.after}}});
  }
  flush();
}

void add_paths(report::Page& page, const std::vector<PathGap>& paths) {
  if (paths.empty()) return;
  page.heading("Whole runs");
  page.text(
      "Each run is predicted from its first pose; errors of the path, rms over the run and at its end.");
  constexpr double kMillimetres = 1000;
  constexpr double kDegrees = 180 / std::numbers::pi;
  std::vector<report::Row> rows;
  for (const PathGap& path : paths)
    rows.push_back({path.recording, path.run, std::string(path.held_out ? "held out" : "searched"),
                    path.length_m, kMillimetres * path.before.rms_m, kMillimetres * path.after.rms_m,
                    kMillimetres * path.before.end_m, kMillimetres * path.after.end_m,
                    kDegrees * path.before.end_heading_rad, kDegrees * path.after.end_heading_rad});
  page.table({{"recording"},
              {"run"},
              {"data"},
              {"length", "m"},
              {"as given", "mm", 1},
              {"new", "mm", 1},
              {"end, as given", "mm", 1},
              {"new", "mm", 1},
              {"heading, as given", "°", 2},
              {"new", "°", 2}},
             rows, "Errors of the paths");
}

}  // namespace

std::string robot_report_html(const RobotFindings& findings) {
  const RobotResult& result = findings.result;
  const std::string name = findings.name.empty() ? "the robot" : findings.name;
  report::Page page("The gap of " + name);
  page.text(fmt::format("{}: {}.", identification::gap::verdict_name(result.verdict), result.reason));
  for (const FoundPart& found : result.effects)
    if (!found.deciding_experiment.empty()) page.text("Next: " + found.deciding_experiment);
  page.heading("The gap");
  add_robot_gap(page, findings);
  add_robot_effects(page, result);
  add_robot_shares(page, findings);
  add_paths(page, findings.paths);
  add_robot_traces(page, result);
  for (const std::string& note : result.notes) page.text(note);
  page.heading("Inputs");
  page.text(fmt::format("Model {}; searched {}; held out {}; seed {}.", findings.base_path,
                        runtime::list_text(findings.data), runtime::list_text(result.held_out),
                        findings.seed));
  return page.html();
}

}  // namespace analysis
