#include "analysis/gap_plots.h"

#include <algorithm>
#include <limits>
#include <string>
#include <utility>

#include "runtime/configuration/quantity.h"
#include "runtime/program/wording.h"

namespace analysis {
namespace {

using report::Series;
using report::Style;
using runtime::number_text;
using runtime::Quantity;
using runtime::quantity_of;

constexpr unsigned kAfter = 0;
constexpr unsigned kBefore = 1;
constexpr unsigned kNoise = 3;
constexpr unsigned kMeasured = 5;  // ink

report::Axis axis_of(const std::string& coordinate) {
  const Quantity quantity = quantity_of(coordinate);
  return {.label = quantity.name, .unit = quantity.unit};
}

/// A line with gaps at empty bins of the map.
Series map_line(const std::string& name, const std::vector<double>& at, const std::vector<double>& residual,
                Style style, unsigned look) {
  Series line{.name = name, .x = {}, .y = {}, .style = style, .look = look};
  double width = std::numeric_limits<double>::infinity();
  for (std::size_t i = 1; i < at.size(); ++i) width = std::min(width, at[i] - at[i - 1]);
  for (std::size_t i = 0; i < at.size(); ++i) {
    if (i > 0 && at[i] - at[i - 1] > 1.5 * width) {
      line.x.push_back(at[i]);
      line.y.push_back(std::numeric_limits<double>::quiet_NaN());
    }
    line.x.push_back(at[i]);
    line.y.push_back(residual[i]);
  }
  return line;
}

}  // namespace

report::Plot steps_plot(const std::vector<double>& gap_Nm, double noise_floor_Nm) {
  Series gap{.name = "gap", .x = {}, .y = gap_Nm, .style = Style::kLineAndPoints, .look = kAfter};
  for (std::size_t i = 0; i < gap_Nm.size(); ++i) gap.x.push_back(static_cast<double>(i));
  const double first = -0.2;
  const double last = static_cast<double>(gap_Nm.size()) - 0.8;
  return {.title = "The gap, step by step",
          .x = {.label = "step of the table", .from = first, .to = last},
          .y = {.label = "held-out gap", .unit = "N·m", .from = 0},
          .series = {gap,
                     {.name = "noise floor",
                      .x = {first, last},
                      .y = {noise_floor_Nm, noise_floor_Nm},
                      .style = Style::kDashed,
                      .look = kNoise}},
          .note = "Down to the dashed line there is something to explain."};
}

report::Plot friction_plot(const identification::gap::FrictionCurve& curve) {
  report::Plot plot{.title = "Friction against velocity",
                    .x = {"velocity", "rad/s"},
                    .y = {"friction torque", "N·m"},
                    .series = {},
                    .note = "Measured: the torque less everything else that the new model has."};
  if (!curve.measured_Nm.empty())
    plot.series.push_back({"measured",
                           curve.measured_velocity_rad_per_s,
                           curve.measured_Nm,
                           Style::kPoints,
                           {},
                           {},
                           kMeasured});
  if (!curve.velocity_rad_per_s.empty()) {
    plot.series.push_back(
        {"model before", curve.velocity_rad_per_s, curve.before_Nm, Style::kDashed, {}, {}, kBefore});
    plot.series.push_back(
        {"model after", curve.velocity_rad_per_s, curve.after_Nm, Style::kLine, {}, {}, kAfter});
  }
  return plot;
}

std::vector<report::Plot> residual_plots(const identification::gap::Result& result) {
  std::vector<report::Plot> plots;
  for (const identification::gap::ResidualMap& map : result.maps) {
    if (map.at.empty()) continue;
    report::Plot plot{.title = "Left over against " + quantity_of(map.coordinate).name,
                      .x = axis_of(map.coordinate),
                      .y = {"torque residual", "N·m"},
                      .series = {}};
    const bool is_spectrum = map.coordinate == "frequency_Hz";
    if (is_spectrum) {
      plot.y = {.label = "rms residual per point", .unit = "N·m", .from = 0};
      plot.note = "All points together, squared and added, are the squared gap.";
    }
    const auto [least, greatest] = std::ranges::minmax(map.at);
    if (!is_spectrum)
      plot.series.push_back({.name = "noise floor",
                             .x = {least, greatest},
                             .y = {},
                             .lower = {-result.noise_floor_Nm, -result.noise_floor_Nm},
                             .upper = {result.noise_floor_Nm, result.noise_floor_Nm},
                             .look = kNoise});
    plot.series.push_back(map_line("before", map.at, map.before_Nm, Style::kDashed, kBefore));
    plot.series.push_back(map_line("after", map.at, map.after_Nm, Style::kLine, kAfter));
    plots.push_back(std::move(plot));
  }
  return plots;
}

std::vector<report::Plot> trace_plots(const identification::gap::Result& result) {
  std::vector<report::Plot> plots;
  for (const identification::gap::Trace& trace : result.traces) {
    if (trace.time_s.empty()) continue;
    plots.push_back(
        {.title = "Velocity in " + trace.recording + ", " + number_text(trace.time_s.front()) + " to " +
                  number_text(trace.time_s.back(), "s"),
         .x = {"time", "s"},
         .y = {"velocity", "rad/s"},
         .series = {
             {"measured", trace.time_s, trace.measured_rad_per_s, Style::kLine, {}, {}, kMeasured},
             {"simulated before", trace.time_s, trace.before_rad_per_s, Style::kDashed, {}, {}, kBefore},
             {"simulated after", trace.time_s, trace.after_rad_per_s, Style::kLine, {}, {}, kAfter}}});
  }
  return plots;
}

std::vector<report::Plot> term_plots(std::span<const model::effects::Empirical::Term> terms) {
  using model::effects::Empirical;
  std::vector<report::Plot> plots;
  for (const Empirical::Term& term : terms) {
    const std::size_t count = term.table.values().size();
    const double steps = static_cast<double>(term.table.repeats() ? count : count - 1);
    Series line{
        .name = "table", .x = {}, .y = term.table.values(), .style = Style::kLineAndPoints, .look = kAfter};
    for (std::size_t i = 0; i < count; ++i)
      line.x.push_back(term.table.from() +
                       static_cast<double>(i) * (term.table.to() - term.table.from()) / steps);
    const std::string factor =
        term.times == Empirical::Times::kOne ? "" : ", times " + std::string(Empirical::name_of(term.times));
    plots.push_back(
        {.title = "No physical name: over " + quantity_of(Empirical::name_of(term.along)).name + factor,
         .x = axis_of(std::string(Empirical::name_of(term.along))),
         .y = {.label = "value", .unit = std::string(Empirical::unit_of(term.times))},
         .series = {std::move(line)}});
  }
  return plots;
}

}  // namespace analysis
