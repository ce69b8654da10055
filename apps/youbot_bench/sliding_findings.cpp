// Friction against velocity.
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
using report::Style;

/// Range in which friction bends most; it contains half of the speeds of the thesis' table 3.
constexpr double kSlow_rad_per_s = 0.75;

struct Map {
  std::vector<double> velocity_rad_per_s;
  std::vector<double> torque_Nm;
  std::vector<double> ci95_Nm;
};

/// In ascending velocity.
Map map_of(const MeasuredJoint& joint) {
  const std::vector<double> velocity = result(joint, "velocity_rad_per_s");
  const std::vector<double> torque = result(joint, "torque_measured_Nm");
  const std::vector<double> ci95 = result(joint, "torque_ci95_Nm");
  std::vector<std::size_t> order;
  for (std::size_t i = 0; i < velocity.size(); ++i)
    if (std::isfinite(velocity[i])) order.push_back(i);  // otherwise it did not turn
  std::ranges::sort(order, {}, [&](std::size_t i) { return velocity[i]; });
  Map map;
  for (const std::size_t i : order) {
    map.velocity_rad_per_s.push_back(velocity[i]);
    map.torque_Nm.push_back(torque[i]);
    map.ci95_Nm.push_back(ci95[i]);
  }
  return map;
}

template <typename Keep>
Map part_of(const Map& map, Keep keep) {
  Map part;
  for (std::size_t i = 0; i < map.velocity_rad_per_s.size(); ++i) {
    if (!keep(map.velocity_rad_per_s[i])) continue;
    part.velocity_rad_per_s.push_back(map.velocity_rad_per_s[i]);
    part.torque_Nm.push_back(map.torque_Nm[i]);
    part.ci95_Nm.push_back(map.ci95_Nm[i]);
  }
  return part;
}

Series series_of(const std::string& name, const Map& map, unsigned look) {
  return points(name, map.velocity_rad_per_s, map.torque_Nm, map.ci95_Nm, look);
}

report::Row row_of(const std::string& joint, const std::string& direction, const Map& map) {
  const std::vector<double> torque = magnitudes(map.torque_Nm);
  const std::vector<double> speed = magnitudes(map.velocity_rad_per_s);
  const auto slowest = static_cast<std::size_t>(std::ranges::min_element(speed) - speed.begin());
  const auto fastest = static_cast<std::size_t>(std::ranges::max_element(speed) - speed.begin());
  const auto lowest = static_cast<std::size_t>(std::ranges::min_element(torque) - torque.begin());
  double widest_Nm = kUnknown;
  for (const double ci95_Nm : map.ci95_Nm) widest_Nm = std::fmax(widest_Nm, ci95_Nm);
  return {joint,
          direction,
          static_cast<double>(speed.size()),
          map.velocity_rad_per_s[slowest],
          map.torque_Nm[slowest],
          map.velocity_rad_per_s[lowest],
          map.torque_Nm[lowest],
          map.velocity_rad_per_s[fastest],
          map.torque_Nm[fastest],
          widest_Nm};
}

}  // namespace

Findings steady_state_findings(const MeasuredExperiment& measured) {
  Plot all{.title = "Friction against velocity",
           .x = {"velocity", "rad/s"},
           .y = {"friction torque", "N·m"},
           .series = {},
           .note = "Bars: 95 % interval of the mean, shorter than a marker where none is seen."};
  Plot slow = all;
  slow.title = "The same at low speed, up to " + runtime::number_text(kSlow_rad_per_s, "rad/s");
  Plot interval{.title = "How well each point is known",
                .x = {"velocity", "rad/s"},
                .y = {"half the 95 % interval", "N·m"},
                .series = {}};
  Findings findings{.table = {.caption = "Friction of each joint and direction",
                              .columns = {{"joint"},
                                          {"direction"},
                                          {"speeds"},
                                          {"slowest", "rad/s"},
                                          {"friction there", "N·m"},
                                          {"least friction at", "rad/s"},
                                          {"least friction", "N·m"},
                                          {"fastest", "rad/s"},
                                          {"friction there", "N·m"},
                                          {"widest ±\u00a095\u00a0%", "N·m"}}}};
  std::vector<double> torques_Nm;
  std::vector<double> speeds_rad_per_s;
  bool beyond_slow = false;
  for (unsigned look = 0; look < measured.joints.size(); ++look) {
    const MeasuredJoint& joint = measured.joints[look];
    const Map map = map_of(joint);
    if (map.torque_Nm.empty()) continue;
    const Map slow_part = part_of(map, [](double v) { return std::abs(v) <= kSlow_rad_per_s; });
    beyond_slow = beyond_slow || slow_part.torque_Nm.size() < map.torque_Nm.size();
    all.series.push_back(series_of(joint.name, map, look));
    if (!slow_part.torque_Nm.empty()) slow.series.push_back(series_of(joint.name, slow_part, look));
    interval.series.push_back({.name = joint.name,
                               .x = map.velocity_rad_per_s,
                               .y = map.ci95_Nm,
                               .style = Style::kPoints,
                               .look = look});
    for (const double torque_Nm : map.torque_Nm) torques_Nm.push_back(std::abs(torque_Nm));
    for (const double v : map.velocity_rad_per_s) speeds_rad_per_s.push_back(std::abs(v));
    const Map forward = part_of(map, [](double v) { return v > 0; });
    const Map backward = part_of(map, [](double v) { return v < 0; });
    if (!forward.torque_Nm.empty()) findings.table.rows.push_back(row_of(joint.name, "forward", forward));
    if (!backward.torque_Nm.empty()) findings.table.rows.push_back(row_of(joint.name, "backward", backward));
  }
  findings.title = findings.table.rows.empty()
                       ? "Friction map: no speed was measured"
                       : "Friction of " + runtime::list_text(names(measured)) + ": " +
                             runtime::range_text(torques_Nm, "N·m") + " at speeds of " +
                             runtime::range_text(speeds_rad_per_s, "rad/s");
  findings.plots.push_back(all);
  if (beyond_slow) findings.plots.push_back(slow);
  findings.plots.push_back(interval);
  return findings;
}

}  // namespace youbot_bench
