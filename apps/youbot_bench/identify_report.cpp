#include "apps/youbot_bench/identify_report.h"

#include <algorithm>
#include <cmath>
#include <string>
#include <string_view>
#include <vector>

#include "analysis/interval_cells.h"
#include "apps/youbot_bench/findings_series.h"
#include "report/report.h"
#include "runtime/configuration/quantity.h"
#include "runtime/program/wording.h"

namespace youbot_bench {
namespace {

namespace fits = identification::fit;
using report::Series;

constexpr int kCurvePoints = 200;  // each direction

struct Points {
  std::vector<double> velocity_rad_per_s;
  std::vector<double> torque_Nm;
  std::vector<double> ci95_Nm;
  void add(const fits::MapPoint& point, double less_Nm = 0.0) {
    velocity_rad_per_s.push_back(point.velocity_rad_per_s);
    torque_Nm.push_back(point.torque_Nm - less_Nm);
    ci95_Nm.push_back(point.torque_ci95_Nm);
  }
  Series series(const std::string& name, unsigned look) const {
    return points(name, velocity_rad_per_s, torque_Nm, ci95_Nm, look);
  }
};

/// From standstill to the fastest point of each direction, denser where the curve bends; a gap at zero, where
/// friction jumps.
Series fitted_curve(const std::string& name, const fits::StaticMap& map, const fits::StaticFit& fit,
                    unsigned look) {
  Series curve{.name = name, .x = {}, .y = {}, .look = look};
  const auto [slowest, fastest] = std::ranges::minmax(
      map.points, {}, [](const fits::MapPoint& point) { return point.velocity_rad_per_s; });
  for (int n = kCurvePoints; n >= -kCurvePoints; --n) {
    const double share = static_cast<double>(n) / kCurvePoints;
    const double end =
        share > 0 ? std::min(slowest.velocity_rad_per_s, 0.0) : -std::max(fastest.velocity_rad_per_s, 0.0);
    const double velocity = end * share * std::abs(share);
    curve.x.push_back(velocity);
    curve.y.push_back(n == 0 ? kUnknown : fit.torque_Nm(velocity));
  }
  return curve;
}

void add_sliding(report::Page& page, std::span<const IdentifiedRig> rigs) {
  report::Plot curves{.title = "Friction against velocity, measured and fitted",
                      .x = {"velocity", "rad/s"},
                      .y = {"friction torque", "N·m"},
                      .series = {}};
  report::Plot residuals{
      .title = "What the laws leave: measured − fitted",
      .x = {"velocity", "rad/s"},
      .y = {"torque", "N·m"},
      .series = {},
      .note = "Without structure and within the 95 % bars there is nothing left to explain."};
  std::vector<Series> laws;
  Points left_out;
  std::vector<report::Row> quality;
  for (unsigned look = 0; look < rigs.size(); ++look) {
    const auto& [model, evidence] = rigs[look];
    if (!model.sliding) continue;
    const fits::StaticFit& fit = *model.sliding;
    Points used;
    Points residual;
    for (std::size_t i = 0; i < evidence.map.points.size(); ++i) {
      const fits::MapPoint& point = evidence.map.points[i];
      const bool out = std::ranges::find(fit.outliers, i) != fit.outliers.end();
      (out ? left_out : used).add(point);
      if (fit.ok() && !out) residual.add(point, fit.torque_Nm(point.velocity_rad_per_s));
    }
    for (const fits::MapPoint& point : evidence.not_asked_for) left_out.add(point);
    curves.series.push_back(used.series(model.name, look));
    if (!fit.ok()) continue;
    laws.push_back(fitted_curve(model.name + ", fitted", evidence.map, fit, look));
    residuals.series.push_back(residual.series(model.name, look));
    quality.push_back({model.name, fits::form_name(fit.form), fit.relative_error_percent,
                       fit.leave_one_out_percent, fit.scatter_Nm,
                       static_cast<double>(evidence.map.points.size()),
                       static_cast<double>(fit.outliers.size())});
  }
  curves.series.insert(curves.series.end(), laws.begin(), laws.end());
  if (!left_out.torque_Nm.empty())
    curves.series.push_back(left_out.series("left out", static_cast<unsigned>(rigs.size())));
  if (curves.series.empty()) return;
  page.heading("Sliding friction");
  std::vector<report::Plot> plots{curves};
  if (!residuals.series.empty()) plots.push_back(residuals);
  page.plots(plots);
  if (quality.empty()) return;
  page.table({{"drive"},
              {"law"},
              {"error", "%"},
              {"leave-one-speed-out error", "%"},
              {"scatter", "N·m"},
              {"points"},
              {"left out"}},
             quality, "How well the laws fit");
}

void add_choice(report::Page& page, std::span<const IdentifiedRig> rigs) {
  std::vector<report::Row> rows;
  for (const auto& [model, evidence] : rigs) {
    if (!evidence.choice) continue;
    for (const fits::ChoiceStep& step : evidence.choice->steps)
      rows.push_back({model.name, fits::term_name(step.term), step.held_out_before_percent,
                      step.held_out_after_percent, step.p_value,
                      std::string(step.added     ? "added"
                                  : step.removal ? "taken out"
                                  : step.drives  ? "not added, friction would drive the joint"
                                                 : "not added")});
  }
  if (rows.empty()) return;
  page.table({{"drive"},
              {"term"},
              {"leave-one-speed-out error without", "%"},
              {"with", "%"},
              {"by chance p"},
              {"decision"}},
             rows, "Terms tried");
}

template <typename EstimatesOf>
void add_parameters(report::Page& page, std::span<const IdentifiedRig> rigs, EstimatesOf estimates_of) {
  std::vector<report::Row> rows;
  for (const auto& [model, evidence] : rigs)
    for (const fits::Estimate& estimate : estimates_of(model)) {
      const runtime::Quantity quantity = quantity_of(estimate);
      const bool known = estimate.ok() || is_given(estimate);
      const auto [value, lower, upper] =
          analysis::interval_cells(known ? estimate.value : kUnknown, estimate);
      rows.push_back(
          {model.name, quantity.name, value, lower, upper, quantity.unit, estimate.not_identifiable});
    }
  if (rows.empty()) return;
  page.table({{"drive"}, {"parameter"}, {"value"}, {"95 % from"}, {"to"}, {"unit"}, {"remark"}}, rows,
             "Parameters with their 95 % intervals");
}

std::vector<fits::Estimate> sliding_estimates(const IdentifiedModel& model) {
  return model.sliding ? model.sliding->parameters : std::vector<fits::Estimate>();
}

/// "Coulomb friction 0.0451 to 0.06 N·m", over the drives for which it was identified; otherwise empty. Of a
/// drive in which several methods found it, the first.
std::string found(std::span<const IdentifiedRig> rigs, const std::string& what, std::string_view effect,
                  std::string_view parameter) {
  std::vector<double> values;
  for (const auto& [model, evidence] : rigs)
    for (const auto& estimates : {sliding_estimates(model), model.moving, model.presliding}) {
      const fits::Estimate* const estimate = fits::find_estimate(estimates, effect, parameter);
      if (estimate == nullptr || !estimate->ok()) continue;
      values.push_back(estimate->value);
      break;
    }
  return values.empty() ? "" : what + " " + runtime::range_text(values, runtime::quantity_of(parameter).unit);
}

std::string title_of(std::span<const IdentifiedRig> rigs) {
  std::vector<std::string> names;
  for (const auto& [model, evidence] : rigs) names.push_back(model.name);
  std::string findings;
  for (const std::string& finding : {found(rigs, "Coulomb friction", "coulomb", "torque_Nm"),
                                     found(rigs, "viscous", "viscous", "coefficient_Nm_s_per_rad"),
                                     found(rigs, "inertia", "", "inertia_kg_m2"),
                                     found(rigs, "bristle stiffness", "presliding", "stiffness_Nm_per_rad")})
    if (!finding.empty()) findings += (findings.empty() ? ": " : ", ") + finding;
  return "Drive model of " + runtime::list_text(names) +
         (findings.empty() ? ": nothing identified" : findings);
}

}  // namespace

void write_identify_report(std::span<const IdentifiedRig> rigs, const std::filesystem::path& directory) {
  report::Page page(title_of(rigs));
  std::string sources;
  for (const auto& [model, evidence] : rigs)
    for (const std::string& line : model.evidence)
      sources += (sources.empty() ? "" : "; ") + model.name + ": " + line;
  page.text(sources + ".");
  add_sliding(page, rigs);
  add_parameters(page, rigs, sliding_estimates);
  add_choice(page, rigs);
  for (const auto& [model, evidence] : rigs)
    if (model.sliding)
      for (const std::string& verdict : model.sliding->verdicts) page.text(model.name + ": " + verdict);
  if (std::ranges::any_of(rigs, [](const IdentifiedRig& rig) { return !rig.model.moving.empty(); })) {
    page.heading("Inertia and friction in motion");
    add_parameters(page, rigs, [](const IdentifiedModel& model) { return model.moving; });
  }
  if (std::ranges::any_of(rigs, [](const IdentifiedRig& rig) { return !rig.model.presliding.empty(); })) {
    page.heading("Pre-sliding");
    add_parameters(page, rigs, [](const IdentifiedModel& model) { return model.presliding; });
  }
  page.write(directory / "report.html");
}

}  // namespace youbot_bench
