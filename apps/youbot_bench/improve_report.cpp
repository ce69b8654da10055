#include "apps/youbot_bench/improve_report.h"

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <cmath>
#include <initializer_list>
#include <optional>
#include <string_view>
#include <utility>
#include <vector>

#include "control/link_map.h"
#include "operation/report.h"
#include "runtime/program/wording.h"

namespace youbot_bench {
namespace {

/// "stribeck", "torque offset or direction asymmetry and cogging", "nothing".
std::string named_by(const analysis::Findings& findings) {
  std::vector<std::string> names;
  for (const identification::gap::FoundEffect& found : findings.result.effects)
    names.push_back(analysis::name_with_rivals(found));
  return runtime::list_text(names);
}

bool names(const analysis::Findings& findings, std::string_view effect) {
  return std::ranges::any_of(findings.result.effects, [&](const identification::gap::FoundEffect& found) {
    return model::effects::name_of(found.effect) == effect ||
           std::ranges::find(found.equivalent, effect) != found.equivalent.end();
  });
}

/// Distance of the wheels from the base's centre: half the diagonal of wheelbase and track.
double reach_m() {
  const control::BaseGeometry geometry;
  return 0.5 * std::hypot(geometry.wheelbase_m, geometry.track_m);
}

/// Mean square over the positions of the four wheels.
double squared_distance_m2(const control::PlanarPose& a, const control::PlanarPose& b) {
  const double x_m = a.x_m - b.x_m;
  const double y_m = a.y_m - b.y_m;
  const double half_angle = std::sin(0.5 * (a.yaw_rad - b.yaw_rad));
  return x_m * x_m + y_m * y_m + 4 * reach_m() * reach_m() * half_angle * half_angle;
}

/// Pairs of runs whose poses are compared.
using Poses = std::vector<control::PlanarPose>;
using Pair = std::pair<const Poses*, const Poses*>;

double rms_distance_m(std::initializer_list<Pair> pairs) {
  double sum_m2 = 0;
  std::size_t count = 0;
  for (const auto& [a, b] : pairs) {
    const std::size_t length = std::min(a->size(), b->size());
    for (std::size_t i = 0; i < length; ++i) sum_m2 += squared_distance_m2((*a)[i], (*b)[i]);
    count += length;
  }
  return count > 0 ? std::sqrt(sum_m2 / static_cast<double>(count)) : 0;
}

std::string millimetres(double distance_m) { return fmt::format("{:.1f} mm", 1e3 * distance_m); }

std::string driving_text(const Improvement& improvement) {
  const std::optional<Drive>& plain = improvement.nothing_hidden;
  const double error_before_m = path_error_m(improvement.base);
  const double error_after_m = path_error_m(improvement.improved);
  std::string text;
  if (less(error_after_m, error_before_m))
    text = "The base drives better with the improved model: ";
  else if (plain && less(apart_m(improvement.improved, *plain), apart_m(improvement.base, *plain)))
    text =
        "With the improved model the base drives more as if nothing were hidden, but no closer to its path: ";
  else
    text = "The base drives no better with the improved model: ";
  text += millimetres(error_before_m) + " off with the known model, " + millimetres(error_after_m) +
          " with the improved one";
  if (!plain) return text + ".";
  text += ", " + millimetres(path_error_m(*plain)) + " with nothing hidden.";
  if (less(error_before_m, path_error_m(*plain)))
    text +=
        " The known model compensates more than the friction, which offsets effects outside all models, such "
        "as the rollers' resistance.";
  return text;
}

/// The direction in which the known model is worse: it shows more.
struct Way {
  const char* name;
  Run Drive::*run;
};
Way shown_way(const Improvement& improvement) {
  const auto error_m = [&](Run Drive::*run) {
    const Run& driven = improvement.base.*run;
    return rms_distance_m({{&driven.X_WB, &driven.reference_X_WB}});
  };
  if (error_m(&Drive::mirrored) > error_m(&Drive::demo)) return {"the demo path mirrored", &Drive::mirrored};
  return {"the demo path", &Drive::demo};
}

struct Named {
  const char* name;
  const Drive& drive;
};

report::Row driving_row(const Named& run, const std::optional<Drive>& plain, const Way& way) {
  const operation::PathMetrics& path = (run.drive.*way.run).summary.path;
  report::Row row{std::string(run.name), 1e3 * path_error_m(run.drive),
                  1e3 * path.rms_m(),    1e3 * path.worst_m(),
                  path.worst_rad(),      100 * path.limited_share()};
  if (plain) row.emplace_back(1e3 * apart_m(run.drive, *plain));
  return row;
}

void add_driving(report::Page& page, const Improvement& improvement) {
  const std::optional<Drive>& plain = improvement.nothing_hidden;
  const Way way = shown_way(improvement);
  std::vector<Named> runs{{"known model", improvement.base}, {"improved models", improvement.improved}};
  if (plain) runs.push_back({"known model, nothing hidden", *plain});
  std::vector<report::Row> rows;
  report::Plot error{.title = "Distance from the reference",
                     .x = {"time", "s"},
                     .y = {"rms of the wheels' places", "m"},
                     .series = {}};
  report::Plot path{.title = "The path", .x = {"x", "m"}, .y = {"y", "m"}, .series = {}, .equal_axes = true};
  const auto add_path = [&path](const char* name, const std::vector<control::PlanarPose>& poses,
                                report::Style style) {
    report::Series series{.name = name, .x = {}, .y = {}, .style = style};
    for (const control::PlanarPose& X_WB : poses) {
      series.x.push_back(X_WB.x_m);
      series.y.push_back(X_WB.y_m);
    }
    path.series.push_back(std::move(series));
  };
  for (const Named& named : runs) {
    const Run& run = named.drive.*way.run;
    rows.push_back(driving_row(named, plain, way));
    report::Series series{.name = named.name, .x = run.time_s, .y = {}};
    for (std::size_t i = 0; i < run.X_WB.size(); ++i)
      series.y.push_back(std::sqrt(squared_distance_m2(run.X_WB[i], run.reference_X_WB[i])));
    error.series.push_back(std::move(series));
    add_path(named.name, run.X_WB, report::Style::kLine);
  }
  add_path("reference", (improvement.base.*way.run).reference_X_WB, report::Style::kDashed);
  std::vector<report::Column> columns{
      {"compensated with"}, {"off the path, both ways, rms", "mm", 1}, {"path error, rms", "mm", 1},
      {"worst", "mm", 1},   {"heading error, worst", "rad", 3},        {"at the force limit", "%", 0}};
  if (plain) columns.push_back({"shifted from the last line, both ways, rms", "mm", 1});
  page.table(columns, rows,
             std::string("Both directions, if a column says \"both ways\"; otherwise, and in the plots, ") +
                 way.name);
  page.plots({error, path});
}

}  // namespace

bool less(double after, double before) {
  constexpr double kWorthTelling = 0.95;
  return after < kWorthTelling * before;
}

double path_error_m(const Drive& drive) {
  return rms_distance_m({{&drive.demo.X_WB, &drive.demo.reference_X_WB},
                         {&drive.mirrored.X_WB, &drive.mirrored.reference_X_WB}});
}

double apart_m(const Drive& drive, const Drive& other) {
  return rms_distance_m({{&drive.demo.X_WB, &other.demo.X_WB}, {&drive.mirrored.X_WB, &other.mirrored.X_WB}});
}

namespace {

std::string search_table(const Improvement& improvement) {
  std::size_t width = 5;
  for (const analysis::Findings& findings : improvement.wheels)
    width = std::max(width, named_by(findings).size());
  std::string text = fmt::format("{:<9}{:<18}{:<{}}  {:<22}{}\n", "drive", "verdict", "named", width,
                                 "gap, held out, N·m", "noise, N·m");
  for (const analysis::Findings& findings : improvement.wheels) {
    const identification::gap::Result& result = findings.result;
    text += fmt::format("{:<9}{:<18}{:<{}}  {:<22}{:.2g}\n", findings.drive,
                        identification::gap::verdict_name(result.verdict), named_by(findings), width,
                        fmt::format("{:.2g} -> {:.2g}", result.gap_before_Nm, result.gap_after_Nm),
                        result.noise_floor_Nm);
  }
  return text + "\n";
}

std::string driving_table(const Improvement& improvement) {
  const Drive& base = improvement.base;
  const Drive& improved = improvement.improved;
  const Way way = shown_way(improvement);
  std::string text = operation::side_by_side(way.name, "known model", (base.*way.run).summary, "improved",
                                             (improved.*way.run).summary);
  const auto row = [&text](const char* name, double left_m, double right_m) {
    text += fmt::format("{:<26}{:>14}{:>14}\n", name, millimetres(left_m), millimetres(right_m));
  };
  text += "both ways round, at the four wheels, rms\n";
  row("  off the path", path_error_m(base), path_error_m(improved));
  if (improvement.nothing_hidden)
    row("  shifted by what is hidden", apart_m(base, *improvement.nothing_hidden),
        apart_m(improved, *improvement.nothing_hidden));
  return text + driving_text(improvement) + "\n";
}

}  // namespace

std::string improvement_text(const Improvement& improvement) {
  std::string text;
  if (!improvement.wheels.empty()) text += search_table(improvement);
  if (!improvement.improved.demo.X_WB.empty()) text += driving_table(improvement);
  return text;
}

std::string reveal_text(const Improvement& improvement, const runtime::HiddenEffect& hidden) {
  const std::string_view effect = model::effects::name_of(hidden.effect());
  const auto right = std::ranges::count_if(
      improvement.wheels, [&](const analysis::Findings& findings) { return names(findings, effect); });
  return fmt::format("Hidden was {}; named on {} of {}.\n", hidden.reveal(), right,
                     runtime::count_text(static_cast<long long>(improvement.wheels.size()), "wheel"));
}

report::Page improvement_page(const Improvement& improvement, const std::string& reveal) {
  report::Page page(
      fmt::format("Search for what the model lacks, and what it brings: path error {:.1f} to {:.1f} mm",
                  1e3 * path_error_m(improvement.base), 1e3 * path_error_m(improvement.improved)));
  page.text(
      "The wheels may have an effect that the known model lacks. It was searched for in recordings of each "
      "wheel in the air; then the base drove the demo path and its mirror image, its friction compensated "
      "with the known and with the improved model. The path error is that of the four wheels, so it includes "
      "heading; the base position is ground truth in simulation, odometry otherwise.");
  page.text(driving_text(improvement));
  std::vector<report::Row> rows;
  for (const analysis::Findings& findings : improvement.wheels) {
    const identification::gap::Result& result = findings.result;
    rows.push_back({findings.drive, std::string(identification::gap::verdict_name(result.verdict)),
                    named_by(findings), result.gap_before_Nm, result.gap_after_Nm, result.noise_floor_Nm,
                    report::Link{"report", findings.drive + "/report.html"}});
  }
  if (!rows.empty())
    page.table({{"drive"},
                {"verdict"},
                {"named"},
                {"gap before", "N·m"},
                {"gap after", "N·m"},
                {"noise", "N·m"},
                {"evidence"}},
               rows, "What the search named");

  add_driving(page, improvement);
  if (!reveal.empty()) {
    page.heading("What was hidden");
    page.text(reveal);
  }
  return page;
}

}  // namespace youbot_bench
