// Smoothing, the spheroid of position control, and rate control (3.4.2 and 3.4.3).
#include <Eigen/Geometry>

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <limits>
#include <numbers>
#include <numeric>
#include <string>
#include <vector>

#include "apps/youbot_bench/thesis/chapters.h"
#include "control/haptic_mapping.h"
#include "control/setpoint_smoothing.h"
#include "sim/hand.h"

namespace youbot_bench::thesis {
namespace {

using control::SetpointSmoothing;
using Eigen::Vector3d;
using report::Plot;
using report::Series;
using report::Style;

constexpr double kMillisecond_s = 1e-3;

struct Smoothed {
  Series x;
  Series y;
  double step_mm = 0;   ///< largest of x in one millisecond
  double turn_deg = 0;  ///< largest rotation in one
};

Smoothed smoothed(const SetpointSmoothing::Config& config, const std::string& name) {
  const Vector3d target_m(0.1, 0.05, 0);
  const Eigen::Quaterniond turned(Eigen::AngleAxisd(std::numbers::pi / 18, Vector3d::UnitZ()));
  SetpointSmoothing smoothing(config);
  smoothing.reset(Vector3d::Zero(), Eigen::Quaterniond::Identity());
  Smoothed result{.x = {.name = "x, " + name, .x = {}, .y = {}},
                  .y = {.name = "y, " + name, .x = {}, .y = {}}};
  control::TipSetpoint before = smoothing.setpoint();
  for (int n = 1; n <= 1200; ++n) {
    const control::TipSetpoint now = smoothing.step(target_m, turned);
    result.x.x.push_back(n * kMillisecond_s);
    result.x.y.push_back(1e3 * now.p_WT_m.x());
    result.y.x.push_back(n * kMillisecond_s);
    result.y.y.push_back(1e3 * now.p_WT_m.y());
    // The last step of each may be the rest of the way.
    if (n < 350) {
      result.step_mm = std::max(result.step_mm, 1e3 * (now.p_WT_m - before.p_WT_m).x());
      result.turn_deg =
          std::max(result.turn_deg, before.q_WT.angularDistance(now.q_WT) * 180 / std::numbers::pi);
    }
    before = now;
  }
  return result;
}

Figure smoothing() {
  constexpr double kNoLimit = std::numeric_limits<double>::infinity();
  const Smoothed printed = smoothed({.acceleration_m_per_s2 = kNoLimit,
                                     .jerk_m_per_s3 = kNoLimit,
                                     .turn_acceleration_rad_per_s2 = kNoLimit,
                                     .turn_jerk_rad_per_s3 = kNoLimit},
                                    "as printed");
  const Smoothed ours = smoothed({}, "by default");
  Figure figure{.number = "Section 3.4.2",
                .caption = "Smoothing of the set-point",
                .text =
                    "A step of 100 mm in x, 50 mm in y and 10 degrees. As printed the set-point starts and "
                    "stops at full speed; by default acceleration and jerk are limited, too."};
  const SetpointSmoothing::Config config;
  figure.compared = {compare("smoothing/step", printed.step_mm), compare("smoothing/turn", printed.turn_deg),
                     compare("smoothing/threshold", 1e3 * config.threshold_m),
                     compare("smoothing/turn threshold", 180 / std::numbers::pi * config.turn_threshold_rad)};
  figure.plots = {{.title = "Set-point",
                   .x = {"time", "s"},
                   .y = {"position", "mm"},
                   .series = {printed.x, printed.y, ours.x, ours.y}}};
  return figure;
}

/// Directions that cover the sphere evenly: a spiral.
std::vector<Vector3d> directions(int count) {
  std::vector<Vector3d> all;
  const double golden = std::numbers::pi * (3 - std::sqrt(5.0));
  for (int n = 0; n < count; ++n) {
    const double z = 1 - 2 * (n + 0.5) / count;
    const double radius = std::sqrt(1 - z * z);
    all.emplace_back(radius * std::cos(golden * n), radius * std::sin(golden * n), z);
  }
  return all;
}

/// The simulated handle, pushed to its stops in all directions.
std::vector<Vector3d> trajectory_m() {
  using namespace std::chrono_literals;
  sim::Hand hand({.travel = sim::GripTravel{}});
  std::vector<Vector3d> at_m;
  for (const Vector3d& direction : directions(300)) {
    hand.move_to(Vector3d(-0.03, 0, 0) + 0.25 * direction, 200ms);
    for (int n = 0; n < 300; ++n) {
      hand.advance(Vector3d::Zero(), 1ms);
      if (n % 10 == 9) at_m.push_back(hand.p_HD_m());
    }
  }
  return at_m;
}

/// Border of position control in the plane of two axes through the device's origin.
Series border(const control::RateBoundary& boundary, Eigen::Index across, Eigen::Index up) {
  Series series{.name = "surface of position control", .x = {}, .y = {}};
  for (int n = 0; n <= 360; ++n) {
    const double angle = n * std::numbers::pi / 180;
    Vector3d direction = Vector3d::Zero();
    direction[across] = std::cos(angle);
    direction[up] = std::sin(angle);
    double inside_m = 0;
    double outside_m = 0.5;
    for (int i = 0; i < 40; ++i) {
      const double middle_m = std::midpoint(inside_m, outside_m);
      (boundary.inside(middle_m * direction) ? inside_m : outside_m) = middle_m;
    }
    series.x.push_back(inside_m * direction[across]);
    series.y.push_back(inside_m * direction[up]);
  }
  return series;
}

Figure spheroid() {
  const control::RateBoundary boundary;
  const std::vector<Vector3d> at_m = trajectory_m();
  Figure figure{
      .number = "Figures 36 and 37",
      .caption = "The handle's travel and the spheroid of position control",
      .text =
          "The thesis moved an omega.6 to its limits and fitted a spheroid inside, cut by two planes. "
          "Points: the simulated handle pushed to its stops, which are an assumption (the thesis' surface, "
          "15 % and 2 cm further out), as its recording is not public. Lines: the surface on which control "
          "changes its mode."};
  figure.compared = {compare("spheroid/centre x", boundary.centre_H_m.x()),
                     compare("spheroid/centre z", boundary.centre_H_m.z()),
                     compare("spheroid/axis x", boundary.half_axes_m.x()),
                     compare("spheroid/axis y", boundary.half_axes_m.y()),
                     compare("spheroid/axis z", boundary.half_axes_m.z()),
                     compare("spheroid/plane x", boundary.least_x_m),
                     compare("spheroid/plane z", boundary.least_z_m)};
  const auto view = [&](const char* title, const char* x, const char* y, Eigen::Index across,
                        Eigen::Index up) {
    Series points{.name = "handle at its stops", .x = {}, .y = {}, .style = Style::kPoints};
    for (const Vector3d& p_m : at_m) {
      points.x.push_back(p_m[across]);
      points.y.push_back(p_m[up]);
    }
    return Plot{.title = title,
                .x = {x, "m"},
                .y = {y, "m"},
                .series = {points, border(boundary, across, up)},
                .note = "Line: the section through the device's origin.",
                .equal_axes = true};
  };
  figure.plots = {view("Top", "x", "y", 0, 1), view("Front", "y", "z", 1, 2), view("Side", "x", "z", 0, 2)};
  return figure;
}

/// Speed of the set-point while the handle is outside, on an end effector that follows at once.
double rate_speed_m_per_s(const control::HapticMapping::Config& config, Series& path) {
  control::HapticMapping mapping(config);
  control::Grip grip;
  control::TipPose tip{.p_WT_m = Vector3d(0.35, 0, 0.35)};
  mapping.index(grip, tip);
  double at_500_ms_m = 0;
  for (int n = 1; n <= 1500; ++n) {
    // Out to the left in 0.1 s, back after a second.
    const double out = n < 1200 ? std::min(1.0, n / 100.0) : 0.0;
    grip.p_HD_m = Vector3d(0, -0.09 * out, 0);
    tip = mapping.step(grip, tip);
    path.x.push_back(n * kMillisecond_s);
    path.y.push_back(tip.p_WT_m.y());
    if (n == 500) at_500_ms_m = tip.p_WT_m.y();
    if (n == 1000) return (tip.p_WT_m.y() - at_500_ms_m) / 0.5;
  }
  return std::nan("");
}

Figure rate_control() {
  Series fast{.name = "1 m/s, as printed", .x = {}, .y = {}};
  Series usual{.name = "by default", .x = {}, .y = {}};
  control::HapticMapping::Config as_printed;
  as_printed.rate_speed_m_per_s = printed_value("rate/thesis");
  const double printed = rate_speed_m_per_s(as_printed, fast);
  const double ours = rate_speed_m_per_s({}, usual);
  Figure figure{.number = "Section 3.4.3",
                .caption = "Rate control: the set-point moves while the handle is outside",
                .text = "The handle goes out to the left and stays there."};
  figure.compared = {
      compare("rate/thesis", printed),
      compare("rate/default", ours, "Deliberately slower: a base of 30 kg does not start at 1 m/s.")};
  figure.plots = {
      {.title = "Set-point to the left", .x = {"time", "s"}, .y = {"y", "m"}, .series = {fast, usual}}};
  return figure;
}

}  // namespace

std::vector<Figure> haptic_mapping(const Workshop& workshop) {
  workshop.begin("workspace of the handle");
  return {smoothing(), rate_control(), spheroid()};
}

}  // namespace youbot_bench::thesis
