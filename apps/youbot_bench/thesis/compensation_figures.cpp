// Friction compensation: one wheel on a spring, the link map, and the base (2.7.2).
#include <spdlog/fmt/fmt.h>

#include <Eigen/Core>

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <string>
#include <variant>
#include <vector>

#include "apps/youbot_bench/experiment_findings.h"
#include "apps/youbot_bench/findings_series.h"
#include "apps/youbot_bench/thesis/chapters.h"
#include "control/link_map.h"
#include "identification/experiments/compensation.h"
#include "operation/config.h"
#include "operation/demo_config.h"
#include "operation/session.h"
#include "runtime/configuration/whole_file.h"
#include "runtime/program/stop_on_signals.h"

namespace youbot_bench::thesis {
namespace {

using report::Plot;
using report::Series;
using report::Style;

/// The thesis prints neither the gain nor the push: these give its picture.
constexpr double kSpring_Nm_per_rad = 0.07;
constexpr double kPush_Nm = 0.3;
constexpr double kPush_s = 0.35;

Figure swinging_wheel(const Workshop& workshop) {
  const identification::experiments::CompensationConfig config{
      .stiffness_Nm_per_rad = kSpring_Nm_per_rad,
      .reference_rad = printed_value("swing/reference"),
      .extra_torque_Nm = printed_value("swing/extra"),
      .push_Nm = kPush_Nm,
      .push_duration_s = kPush_s};
  const MeasuredExperiment measured =
      workshop.measure("figure-28", workshop.thesis_robot(), config, "wheel-1");
  const MeasuredJoint& joint = measured.joints.at(0);
  const std::vector<Trace> all = traces(measured, joint, 3600);
  Plot plot{.title = "Position of wheel 1",
            .x = {"time since the push", "s"},
            .y = {"position", "rad"},
            .series = {},
            .note = "From the position at which the wheel rested before the push."};
  double highest_rad = 0;
  for (const Trace& trace : all) {
    const bool with = trace.measurement() == 1;
    const std::vector<double> x_rad = trace.displacement_rad();
    if (with) highest_rad = *std::ranges::max_element(x_rad);
    plot.series.push_back({.name = with ? "with compensation" : "without", .x = trace.time_s(), .y = x_rad});
  }
  const std::vector<double> swings = result(joint, "swings");
  const Findings findings = compensation_findings(measured);
  Figure figure{.number = "Figure 28",
                .caption = "A wheel on a spring in software, with friction compensation",
                .text = fmt::format("u = -Kp·(x - xr) + F + {:g} N·m on wheel 1 of the thesis' robot, with "
                                    "xr = {:g} rad. Kp and the hand's push are not printed: {:g} N·m/rad and "
                                    "{:g} N·m for {:g} s give the picture. With compensation the wheel "
                                    "makes {:g} half swings, without it {:g}, and stays where friction "
                                    "holds it.",
                                    config.extra_torque_Nm, config.reference_rad, kSpring_Nm_per_rad,
                                    kPush_Nm, kPush_s, swings.at(1), swings.at(0))};
  constexpr const char* kChosen =
      "Kp and the push decide it. Ours were chosen to give the picture, as the thesis does not print its "
      "own.";
  figure.compared = {compare("swing/reference", measured.setting("reference_rad", kUnknown)),
                     compare("swing/extra", measured.setting("extra_torque_Nm", kUnknown)),
                     compare("swing/highest", highest_rad, kChosen),
                     compare("swing/count", swings.at(1), kChosen)};
  figure.tables = {{findings.table.caption, findings.table.columns, findings.table.rows}};
  figure.plots = {plot};
  return figure;
}

Figure link_map() {
  Figure figure{
      .number = "Figure 29 and the link map",
      .caption = "Wheel speeds to the motion of the base",
      .text = "The printed matrix, and what control/link_map.h gives for one wheel at a time at 1 rad/s."};
  constexpr std::array<const char*, 3> kRows{"yaw", "vx", "vy"};
  constexpr std::array<Eigen::Index, 3> kPlanar{2, 0, 1};  // yaw, x, y of a planar vector
  const control::LinkMap map = control::LinkMap::without_geometry();
  for (std::size_t row = 0; row < kRows.size(); ++row)
    for (Eigen::Index wheel = 0; wheel < 4; ++wheel)
      figure.compared.push_back(compare(fmt::format("link map/{} {}", kRows[row], wheel + 1),
                                        map.twist(control::WheelVector::Unit(wheel))[kPlanar[row]]));
  return figure;
}

/// The thesis' robot on the ground: loaded wheels have more friction.
std::vector<model::effects::DriveModel> loaded(const Wheels& wheels, const std::array<double, 4>& scale) {
  std::vector<model::effects::DriveModel> models(wheels.models.begin(), wheels.models.end());
  for (std::size_t i = 0; i < models.size(); ++i)
    for (model::effects::AnyEffect& effect : models[i].effects)
      if (const auto* const friction = std::get_if<model::effects::FrictionLaw>(&effect))
        effect = model::effects::FrictionLaw(friction->law().with("scale", scale[i]));
  return models;
}

struct BaseDrive {
  std::string name;
  operation::Summary summary;
  Series path;
  double furthest_m = 0.0;  ///< from the start
};

BaseDrive drive_base(const operation::Config& config, const std::string& name) {
  BaseDrive drive{.name = name, .summary = {}, .path = {.name = name, .x = {}, .y = {}}};
  operation::SessionOptions options;
  options.virtual_time = true;
  options.after_cycle = [&drive, cycle = 0](const operation::CycleRecord& record) mutable {
    if (!std::isfinite(record.truth_W[0])) return;
    drive.furthest_m = std::max(drive.furthest_m, std::hypot(record.truth_W[0], record.truth_W[1]));
    if (cycle++ % 100 != 0) return;
    drive.path.x.push_back(record.truth_W[0]);
    drive.path.y.push_back(record.truth_W[1]);
  };
  drive.summary = operation::run_session(config, options, runtime::stop_requested);
  Workshop::go_on();
  return drive;
}

Series reference_path(const operation::Config& config) {
  Series series{.name = "reference", .x = {}, .y = {}, .style = Style::kDashed};
  const control::BasePath path(config.path);
  for (double t = 0; t < path.duration_s(); t += 0.1) {
    const control::BaseReference at = path.at(t);
    series.x.push_back(at.X_WB.x_m);
    series.y.push_back(at.X_WB.y_m);
  }
  return series;
}

Figure base_figure(const Workshop& workshop) {
  workshop.begin("section-2.7.2");
  const std::filesystem::path file = workshop.directory() / "base.toml";
  runtime::write_whole_file(file, operation::kDemoConfig);
  operation::Config config = operation::load_config(file);
  std::filesystem::remove(file);  // the runs below change it
  config.robot.simulation.models =
      loaded(workshop.thesis_robot(), config.robot.simulation.loaded_friction_scale);
  config.robot.ethercat.unsigned_current = true;
  config.cycle.allow_any_following_error();
  operation::Config velocity = config;
  velocity.cycle.controller.compensate_friction = false;
  velocity.cycle.controller.stiffness = control::PlanarVector::Zero();
  operation::Config spring = config;
  spring.cycle.controller.compensate_friction = false;
  const std::vector<BaseDrive> drives{drive_base(velocity, "velocity control, without compensation"),
                                      drive_base(spring, "spring and damper, without compensation"),
                                      drive_base(config, "spring and damper, with compensation")};
  Figure figure{.number = "Section 2.7.2",
                .caption = "The base with and without friction compensation",
                .text =
                    "The path of youbotd's demonstration (1 m forward, 0.5 m left, a turn and a circle) on "
                    "the thesis' robot on the ground, its wheels with 1.10 to 1.30 times the friction of "
                    "the curves. First with the thesis' old control, proportional to the error of "
                    "velocity, then with the spring and damper of the control model, and with "
                    "compensation. All may push with 5 N. The thesis saw the same without numbers: the old "
                    "control did not start the base, the compensated one did."};
  FigureTable table{.caption = "True motion of the base",
                    .columns = {{"control"},
                                {"furthest from the start", "mm", 1},
                                {"path error, rms", "mm", 1},
                                {"path error, largest", "mm", 1}},
                    .rows = {}};
  Plot plot{.title = "Path from above",
            .x = {"x", "m"},
            .y = {"y", "m"},
            .series = {reference_path(config)},
            .equal_axes = true};
  for (const BaseDrive& drive : drives) {
    table.rows.push_back({drive.name, 1e3 * drive.furthest_m, 1e3 * drive.summary.path.rms_m(),
                          1e3 * drive.summary.path.worst_m()});
    plot.series.push_back(drive.path);
    if (!drive.summary.stop_reason.empty())
      figure.text += " Stopped " + drive.name + ": " + drive.summary.stop_reason + ".";
  }
  figure.compared = {
      compare("base/without", 1e3 * drives[0].furthest_m,
              "The demonstration's limit of 5 N decides it. The base sticks on the straight lines; on the "
              "circle force and moment together bring single wheels to their break-away for a moment."),
      compare("base/with", 1e3 * drives[2].summary.path.worst_m())};
  figure.tables = {table};
  figure.plots = {plot};
  return figure;
}

}  // namespace

std::vector<Figure> compensation(const Workshop& workshop) {
  return {swinging_wheel(workshop), link_map(), base_figure(workshop)};
}

}  // namespace youbot_bench::thesis
