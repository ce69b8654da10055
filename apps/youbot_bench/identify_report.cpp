#include "apps/youbot_bench/identify_report.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>
#include <vector>

#include "apps/report/report.h"

namespace youbot_bench {
namespace {

namespace fits = sim::identify;

constexpr int kCurvePoints = 200;  // each direction

/// Points with their intervals; those without one have none drawn.
report::Series points(const std::string& name) {
  return {.name = name, .x = {}, .y = {}, .style = report::Style::kPoints, .lower = {}, .upper = {}};
}
void add(report::Series& series, double velocity, double torque, double half_interval) {
  series.x.push_back(velocity);
  series.y.push_back(torque);
  series.lower.push_back(torque - half_interval);
  series.upper.push_back(torque + half_interval);
}

/// From standstill to the fastest point of each direction, closer where the curve bends; a gap at zero, where
/// friction jumps.
report::Series fitted_curve(const fits::StaticMap& map, const fits::StaticFit& fit) {
  report::Series curve{.name = fits::form_name(fit.form), .x = {}, .y = {}};
  const auto [slowest, fastest] = std::ranges::minmax(
      map.points, {}, [](const fits::MapPoint& point) { return point.velocity_rad_per_s; });
  for (int n = kCurvePoints; n >= -kCurvePoints; --n) {
    const double share = static_cast<double>(n) / kCurvePoints;
    const double end =
        share > 0 ? std::min(slowest.velocity_rad_per_s, 0.0) : -std::max(fastest.velocity_rad_per_s, 0.0);
    const double velocity = end * share * std::abs(share);
    curve.x.push_back(velocity);
    curve.y.push_back(n == 0 ? std::numeric_limits<double>::quiet_NaN() : fit.torque_Nm(velocity));
  }
  return curve;
}

void add_sliding(report::Page& page, const fits::StaticMap& map, const fits::StaticFit& fit) {
  report::Series used = points("measured, 95 %");
  report::Series left_out = points("left out");
  report::Series residual = points("measured − fitted, 95 %");
  for (std::size_t i = 0; i < map.points.size(); ++i) {
    const fits::MapPoint& point = map.points[i];
    const bool out = std::ranges::find(fit.outliers, i) != fit.outliers.end();
    add(out ? left_out : used, point.velocity_rad_per_s, point.torque_Nm, point.torque_ci95_Nm);
    if (fit.ok() && !out)
      add(residual, point.velocity_rad_per_s, point.torque_Nm - fit.torque_Nm(point.velocity_rad_per_s),
          point.torque_ci95_Nm);
  }
  report::Plot curve{.title = "Friction against velocity",
                     .x = {"velocity", "rad/s"},
                     .y = {"friction torque", "N·m"},
                     .series = {used}};
  if (!left_out.x.empty()) curve.series.push_back(left_out);
  if (!fit.ok()) {
    page.plot(curve);
    return;
  }
  curve.series.push_back(fitted_curve(map, fit));
  page.plots({curve,
              {.title = "What the law leaves",
               .x = {"velocity", "rad/s"},
               .y = {"torque", "N·m"},
               .series = {residual},
               .note = "Without structure and within the bars there is nothing left to explain."}});
  page.table(
      {{"error", "%"}, {"leave-one-speed-out error", "%"}, {"scatter", "N·m"}, {"points"}, {"left out"}},
      {{fit.relative_error_percent, fit.leave_one_out_percent, fit.scatter_Nm,
        static_cast<double>(map.points.size()), static_cast<double>(fit.outliers.size())}},
      "How well the law fits");
}

void add_choice(report::Page& page, const fits::ModelChoice& choice) {
  std::vector<report::Row> rows;
  for (const fits::ChoiceStep& step : choice.steps)
    rows.push_back({std::string(fits::term_name(step.term)), step.held_out_before_percent,
                    step.held_out_after_percent, step.p_value,
                    std::string(step.added     ? "added"
                                : step.removal ? "taken out"
                                               : "not added")});
  page.table({{"term"}, {"held-out error without", "%"}, {"with", "%"}, {"by chance p"}, {"decision"}}, rows,
             "Terms tried, each speed predicted from the others");
}

void add_parameters(report::Page& page, const std::string& caption,
                    const std::vector<fits::Estimate>& estimates) {
  if (estimates.empty()) return;
  constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
  std::vector<report::Row> rows;
  for (const fits::Estimate& estimate : estimates)
    rows.push_back({estimate.name, estimate.ok() ? estimate.value : kNone,
                    estimate.ok() ? estimate.lower : kNone, estimate.ok() ? estimate.upper : kNone,
                    estimate.not_identifiable});
  page.table({{"parameter"}, {"value"}, {"from"}, {"to"}, {"remark"}}, rows, caption);
}

}  // namespace

void write_identify_report(const IdentifiedModel& model, const IdentificationEvidence& evidence,
                           const std::filesystem::path& directory) {
  report::Page page("Drive model of " + model.name);
  for (const std::string& line : model.evidence) page.text(line);
  if (model.sliding) {
    page.heading("Sliding friction");
    add_sliding(page, evidence.map, *model.sliding);
    add_parameters(page, "Parameters with their 95 % intervals", model.sliding->parameters);
    if (evidence.choice) add_choice(page, *evidence.choice);
    for (const std::string& verdict : model.sliding->verdicts) page.text(verdict);
  }
  if (!model.moving.empty()) {
    page.heading("Inertia and friction in motion");
    add_parameters(page, "Parameters with their 95 % intervals", model.moving);
  }
  if (!model.presliding.empty()) {
    page.heading("Pre-sliding");
    add_parameters(page, "Parameters with their 95 % intervals", model.presliding);
  }
  page.write(directory / "report.html");
}

}  // namespace youbot_bench
