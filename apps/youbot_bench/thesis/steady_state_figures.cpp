// Friction over velocity: the campaign of 2.5.1 on the thesis' robot, and the curves of 2.6 and appendix A.
#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <string>
#include <vector>

#include "apps/youbot_bench/findings_series.h"
#include "apps/youbot_bench/thesis/chapters.h"
#include "identification/experiments/steady_state.h"
#include "identification/experiments/velocity_sets.h"
#include "identification/fit/static_fit.h"
#include "identification/fit/static_map.h"
#include "model/friction/any_law.h"
#include "model/friction/wheel_curve.h"
#include "runtime/program/wording.h"

namespace youbot_bench::thesis {
namespace {

namespace fits = identification::fit;
using identification::experiments::kTable3;
using identification::experiments::SteadyStateConfig;
using report::Plot;
using report::Series;
using report::Style;

const report::Axis kWheelVelocity{"velocity", "rad/s"};
const report::Axis kWheelFriction{"friction torque", "N·m"};
/// The simulated drive has no warm-up: shorter times give the same means.
constexpr double kShortSettle_s = 1;
constexpr double kShortMeasure_s = 1;
/// At which friction differs by direction.
constexpr double kHighSpeed_rad_per_s = 9.0;
/// Speeds of the fit of table 4.
constexpr double kLowSpeeds_rad_per_s = 1.0;

/// The map of a joint. The current is reported without its sign; friction opposes the motion.
fits::StaticMap signed_map(const MeasuredJoint& joint) {
  fits::StaticMap map{.rig = joint.name, .points = {}};
  const std::vector<double> velocity = result(joint, "velocity_rad_per_s");
  const std::vector<double> torque = result(joint, "torque_measured_Nm");
  const std::vector<double> interval = result(joint, "torque_ci95_Nm");
  for (std::size_t i = 0; i < velocity.size(); ++i)
    if (std::isfinite(velocity[i]))
      map.points.push_back({velocity[i], std::copysign(torque[i], velocity[i]),
                            std::isfinite(interval[i]) ? interval[i] : 0.0});
  std::ranges::sort(map.points, {}, &fits::MapPoint::velocity_rad_per_s);
  return map;
}

/// The joint's friction at a speed, on the line between its neighbours; NaN outside of the map.
double friction_at(const fits::StaticMap& map, double velocity_rad_per_s) {
  const auto after =
      std::ranges::lower_bound(map.points, velocity_rad_per_s, {}, &fits::MapPoint::velocity_rad_per_s);
  const auto nearest = [&](auto point) { return std::abs(point->velocity_rad_per_s - velocity_rad_per_s); };
  if (after != map.points.end() && nearest(after) < 1e-3) return after->torque_Nm;
  if (after == map.points.begin() || after == map.points.end()) return std::nan("");
  const auto before = after - 1;
  if (nearest(before) < 1e-3) return before->torque_Nm;
  const double share = (velocity_rad_per_s - before->velocity_rad_per_s) /
                       (after->velocity_rad_per_s - before->velocity_rad_per_s);
  return std::lerp(before->torque_Nm, after->torque_Nm, share);
}

Series measured_series(const fits::StaticMap& map, unsigned look) {
  Series series{.name = map.rig, .x = {}, .y = {}, .style = Style::kPoints, .look = look};
  for (const fits::MapPoint& point : map.points) {
    series.x.push_back(point.velocity_rad_per_s);
    series.y.push_back(point.torque_Nm);
  }
  return series;
}

Series printed_curve(int wheel, unsigned look) {
  Series series{.name = fmt::format("appendix A, wheel {}", wheel), .x = {}, .y = {}, .look = look};
  for (int n = -1000; n <= 1000; ++n) {
    series.x.push_back(0.01 * n);
    series.y.push_back(model::friction::wheel_curve_Nm(wheel, series.x.back()));
  }
  return series;
}

Figure table_3() {
  Figure figure{
      .number = "Table 3",
      .caption = "Sets of velocities of the campaign",
      .text =
          "As identification/experiments lays them out. The last set cannot be as printed: 13 measurements "
          "by 0.5 rad/s that end at -10 begin at -4, within the set before; the number is kept."};
  FigureTable table{
      .caption = "Velocities", .columns = {{"set"}, {"first", "rad/s"}, {"last", "rad/s"}}, .rows = {}};
  for (std::size_t i = 0; i < kTable3.size(); ++i) {
    const std::vector<double> speeds = identification::experiments::velocities_rad_per_s(kTable3[i]);
    figure.compared.push_back(
        compare(fmt::format("table 3/set {}", i + 1), static_cast<double>(speeds.size())));
    table.rows.push_back({static_cast<double>(i + 1), speeds.front(), speeds.back()});
  }
  figure.tables = {table};
  return figure;
}

/// Ten speeds with the printed times.
Figure one_measurement(const Workshop& workshop) {
  const SteadyStateConfig printed{.sets = "1"};
  const MeasuredExperiment measured =
      workshop.measure("figure-14", workshop.thesis_robot(), printed, "wheel-1");
  Figure figure{
      .number = "Figure 14",
      .caption = "One measurement: settle for T1, measure for T2",
      .text =
          "Wheel 1 of the thesis' robot at the first velocity of set 1, with the printed times. Shaded: "
          "the time from which the mean is taken."};
  const MeasuredJoint& joint = measured.joints.at(0);
  const double whole_s = measured.finished_until_s.at(0);
  figure.compared = {compare("steady state/T1", measured.setting("settle_s", kUnknown)),
                     compare("steady state/T2", measured.setting("measure_s", kUnknown)),
                     compare("steady state/whole", whole_s)};
  Series velocity{.name = "velocity", .x = {}, .y = {}};
  Series torque{.name = "torque", .x = {}, .y = {}};
  const auto time_s = joint.rows.column("time_s");
  for (std::size_t i = 0; i < time_s.size() && time_s[i] <= whole_s; ++i) {
    velocity.x.push_back(time_s[i]);
    velocity.y.push_back(joint.rows.column("velocity_rad_per_s")[i]);
    torque.x.push_back(time_s[i]);
    torque.y.push_back(joint.rows.column("torque_measured_Nm")[i]);
  }
  const report::Axis time{.label = "time", .unit = "s", .link = "figure 14"};
  const std::vector<report::Span> spans{{"T2", printed.settle_s, printed.settle_s + printed.measure_s}};
  figure.plots = {{.title = "Velocity", .x = time, .y = kWheelVelocity, .series = {velocity}, .spans = spans},
                  {.title = "Torque, measured",
                   .x = time,
                   .y = {"torque", "N·m"},
                   .series = {torque},
                   .note = "Means over 0.1 s.",
                   .spans = spans}};
  return figure;
}

/// The whole campaign with shorter times.
std::vector<fits::StaticMap> campaign(const Workshop& workshop) {
  const MeasuredExperiment measured = workshop.measure(
      "figure-15", workshop.thesis_robot(),
      SteadyStateConfig{.settle_s = kShortSettle_s, .measure_s = kShortMeasure_s, .extra_s = 0}, {}, false);
  std::vector<fits::StaticMap> maps;
  for (const MeasuredJoint& joint : measured.joints) maps.push_back(signed_map(joint));
  return maps;
}

/// Speed of the least friction in this direction from 0.3 rad/s on: below, friction rises from rest.
double dip_rad_per_s(const fits::StaticMap& map, double direction) {
  double least_Nm = kUnbounded;
  double at = kUnknown;
  for (const fits::MapPoint& point : map.points) {
    const double speed = direction * point.velocity_rad_per_s;
    if (speed < 0.3 || std::abs(point.torque_Nm) >= least_Nm) continue;
    least_Nm = std::abs(point.torque_Nm);
    at = speed;
  }
  return at;
}

Figure friction_maps(const std::vector<fits::StaticMap>& maps) {
  Figure figure{
      .number = "Figure 15",
      .caption = "Friction over velocity of the four wheels",
      .text = fmt::format("All 312 velocities of table 3, on all wheels at once, with {:g} s to settle and "
                          "{:g} s of measuring in place of 50 and 30: the simulated drives do not warm up. "
                          "The sensor reports the current without its sign; friction has that of the "
                          "velocity. As printed, friction is low between 1 and 4 rad/s and then rises "
                          "steeply, and at high speeds it rises faster backward than forward.",
                          kShortSettle_s, kShortMeasure_s)};
  Plot plot{.title = "Friction over velocity", .x = kWheelVelocity, .y = kWheelFriction, .series = {}};
  FigureTable dips{.caption = "Speed of the least friction above 0.3 rad/s",
                   .columns = {{"wheel"}, {"forward", "rad/s"}, {"backward", "rad/s"}, {"points"}},
                   .rows = {}};
  double fastest = kUnbounded;
  double least_ratio = kUnbounded;  // of friction backward to forward
  for (unsigned i = 0; i < maps.size(); ++i) {
    fastest = std::min(
        {fastest, maps[i].points.back().velocity_rad_per_s, -maps[i].points.front().velocity_rad_per_s});
    least_ratio = std::min(least_ratio, friction_at(maps[i], -kHighSpeed_rad_per_s) /
                                            -friction_at(maps[i], kHighSpeed_rad_per_s));
    plot.series.push_back(measured_series(maps[i], i));
    const double forward = dip_rad_per_s(maps[i], 1);
    const double backward = dip_rad_per_s(maps[i], -1);
    dips.rows.push_back({maps[i].rig, forward, backward, static_cast<double>(maps[i].points.size())});
    const char* const why = i == 3 ? "The text speaks of all wheels, but appendix A's own line for wheel 4 "
                                     "rises from 0.555 to 1.867 rad/s."
                                   : "";
    figure.compared.push_back(compare(fmt::format("figure 15/dip {}", i + 1), forward, why));
    figure.compared.push_back(compare(fmt::format("figure 15/dip {}, backward", i + 1), backward, why));
  }
  figure.compared.push_back(compare("figure 15/fastest", fastest));
  figure.compared.push_back(compare("figure 15/backward", least_ratio));
  figure.plots = {plot};
  figure.tables = {dips};
  return figure;
}

struct CurvePoint {
  const char* key;
  std::size_t wheel;
  double velocity_rad_per_s;
};
constexpr auto kCurvePoints = std::to_array<CurvePoint>({{"curve/wheel 1 at 1", 1, 1},
                                                         {"curve/wheel 1 at 3.2", 1, 3.2},
                                                         {"curve/wheel 1 at -9", 1, -9},
                                                         {"curve/wheel 2 at 2", 2, 2},
                                                         {"curve/wheel 2 at -4", 2, -4},
                                                         {"curve/wheel 3 at 0.2", 3, 0.2},
                                                         {"curve/wheel 3 at 5", 3, 5},
                                                         {"curve/wheel 4 at 0.2", 4, 0.2},
                                                         {"curve/wheel 4 at -7", 4, -7}});

Figure fitted_curves(const std::vector<fits::StaticMap>& maps) {
  Figure figure{
      .number = "Figure 25 and appendix A",
      .caption = "The measured friction and the published curves",
      .text =
          "Points: the campaign of figure 15 on the simulated robot. Lines: the functions that appendix A "
          "prints for each wheel. The thesis prints no residual of its own fit. Next to rest the published "
          "line falls to zero and cannot stick, so the simulated wheel holds its level below 0.02 rad/s."};
  Plot plot{.title = "Friction over velocity", .x = kWheelVelocity, .y = kWheelFriction, .series = {}};
  FigureTable residuals{
      .caption = "Campaign less curve, above 0.02 rad/s",
      .columns = {{"wheel"}, {"rms", "mN·m", 3}, {"largest", "mN·m", 3}, {"at", "rad/s", 3}},
      .rows = {}};
  for (unsigned i = 0; i < maps.size(); ++i) {
    const int wheel = static_cast<int>(i) + 1;
    plot.series.push_back(measured_series(maps[i], i));
    plot.series.push_back(printed_curve(wheel, i));
    double squares = 0;
    double count = 0;
    double largest = 0;
    double at = 0;
    for (const fits::MapPoint& point : maps[i].points) {
      if (std::abs(point.velocity_rad_per_s) < 0.0205) continue;
      const double off = point.torque_Nm - model::friction::wheel_curve_Nm(wheel, point.velocity_rad_per_s);
      squares += off * off;
      count += 1;
      if (std::abs(off) > largest) {
        largest = std::abs(off);
        at = point.velocity_rad_per_s;
      }
    }
    residuals.rows.push_back({maps[i].rig, 1e3 * std::sqrt(squares / count), 1e3 * largest, at});
  }
  for (const CurvePoint& point : kCurvePoints)
    figure.compared.push_back(
        compare(point.key, friction_at(maps.at(point.wheel - 1), point.velocity_rad_per_s)));
  figure.plots = {plot};
  figure.tables = {residuals};
  return figure;
}

/// Forward speeds up to 1 rad/s, from which 2.5.1 has table 4.
fits::StaticMap low_speeds(fits::StaticMap map) {
  leave_out(map, {.below_rad_per_s = kLowSpeeds_rad_per_s});
  std::erase_if(map.points, [](const fits::MapPoint& point) { return point.velocity_rad_per_s <= 0; });
  return map;
}

fits::StaticFit kfm_fit(const fits::StaticMap& map) {
  return fits::fit_static(map, fits::form_named("kfm"), {.leave_one_out = false});
}

struct Table4Row {
  const char* key;
  fits::EffectParameter parameter;
};
constexpr auto kTable4 = std::to_array<Table4Row>({{"table 4/Fc", fits::terms::kCoulomb},
                                                   {"table 4/Fs", fits::terms::kStribeck},
                                                   {"table 4/vs", fits::terms::kStribeckVelocity},
                                                   {"table 4/exponent", fits::terms::kStribeckExponent},
                                                   {"table 4/viscous", fits::terms::kViscous}});

double value_of(const fits::StaticFit& fit, const fits::EffectParameter& parameter) {
  const fits::Estimate* const estimate =
      fits::find_estimate(fit.parameters, parameter.effect, parameter.name);
  return estimate == nullptr ? kUnknown : estimate->value;
}

Series fit_curve(const std::string& name, const fits::StaticFit& fit) {
  Series series{.name = name, .x = {}, .y = {}, .style = Style::kDashed};
  for (int n = 1; n <= 200; ++n) {
    series.x.push_back(0.005 * n);
    series.y.push_back(fit.torque_Nm(series.x.back()));
  }
  return series;
}

Series table_4_curve() {
  Series series{.name = "kinetic friction model with table 4", .x = {}, .y = {}};
  const model::friction::AnyLaw law = model::friction::make_law("kfm");
  for (int n = 1; n <= 200; ++n) {
    series.x.push_back(0.005 * n);
    series.y.push_back(law.steady_Nm(series.x.back()));
  }
  return series;
}

struct Apart {
  double rms_Nm;
  double share;    ///< of the curve's mean
  double peak_Nm;  ///< of the curve below 0.3 rad/s
};
/// Appendix A's curve of wheel 1 and the kinetic friction model with table 4, below 1 rad/s.
Apart apart() {
  const Series table = table_4_curve();
  double squares = 0;
  double sum = 0;
  double peak = 0;
  for (std::size_t i = 0; i < table.x.size(); ++i) {
    const double curve = model::friction::wheel_curve_Nm(1, table.x[i]);
    squares += (table.y[i] - curve) * (table.y[i] - curve);
    sum += curve;
    if (table.x[i] < 0.3) peak = std::max(peak, curve);
  }
  const auto count = static_cast<double>(table.x.size());
  return {std::sqrt(squares / count), std::sqrt(squares / count) / (sum / count), peak};
}

Figure low_speed_fit(const Workshop& workshop, const std::vector<fits::StaticMap>& maps) {
  const fits::StaticMap low = low_speeds(maps.front());
  const fits::StaticFit fit = kfm_fit(low);
  const MeasuredExperiment measured = workshop.measure(
      "table-4", workshop.robot_with_law("kfm"),
      SteadyStateConfig{
          .settle_s = kShortSettle_s, .measure_s = kShortMeasure_s, .extra_s = 0, .sets = "2-4"},
      "wheel-1", false);
  fits::StaticMap as_table_4 = low_speeds(signed_map(measured.joints.at(0)));
  as_table_4.rig = "a wheel with table 4";
  const fits::StaticFit again = kfm_fit(as_table_4);
  Figure figure{.number = "Figure 17 and table 4",
                .caption = "The kinetic friction model fitted to wheel 1 below 1 rad/s",
                .text = fmt::format("Where table 4 comes from: the thesis fitted it with Matlab's curve "
                                    "fitting toolbox to raw points of wheel 1, without those that it left "
                                    "out (the stars of figure 17); neither are public. It cannot come back "
                                    "from what is printed: below 1 rad/s appendix A's curve of wheel 1 and "
                                    "the kinetic friction model with table 4 are {:.1f} mN·m rms apart, "
                                    "{:.0f} % of the friction there. The curve has a peak of {:.4f} N·m "
                                    "near rest, the model goes up to Fs = {:.4f}. Ours is the fit to the "
                                    "points of figure 15. The rows of a wheel that has table 4 show that the "
                                    "method is right: on such a wheel the same experiment and the same fit "
                                    "return it.",
                                    1e3 * apart().rms_Nm, 100 * apart().share, apart().peak_Nm,
                                    printed_value("table 4/Fs"))};
  constexpr const char* kWhy =
      "Fitted to a simulation of the published curve, not to the points behind table 4.";
  constexpr const char* kReturned =
      "The same experiment and fit, on a simulated wheel whose friction is that of table 4.";
  for (const Table4Row& row : kTable4) {
    figure.compared.push_back(compare(row.key, value_of(fit, row.parameter), kWhy));
    figure.compared.push_back(
        compare(std::string(row.key) + ", method", value_of(again, row.parameter), kReturned));
  }
  Plot plot{.title = "Wheel 1 at low speed",
            .x = kWheelVelocity,
            .y = kWheelFriction,
            .series = {measured_series(low, 0), table_4_curve()}};
  if (fit.ok()) plot.series.push_back(fit_curve("fit to these points", fit));
  plot.series.push_back(measured_series(as_table_4, 3));
  figure.plots = {plot};
  return figure;
}

}  // namespace

std::vector<Figure> steady_state(const Workshop& workshop) {
  std::vector<Figure> figures{one_measurement(workshop), table_3()};
  const std::vector<fits::StaticMap> maps = campaign(workshop);
  figures.push_back(friction_maps(maps));
  figures.push_back(low_speed_fit(workshop, maps));
  figures.push_back(fitted_curves(maps));
  return figures;
}

}  // namespace youbot_bench::thesis
