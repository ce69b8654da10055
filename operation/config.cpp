#include "operation/config.h"

#include <spdlog/fmt/fmt.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <optional>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "control/robot_model.h"
#include "model/effects/resistance.h"
#include "operation/setting_bounds.h"
#include "operation/teleop_config.h"
#include "runtime/configuration/can_config.h"
#include "runtime/configuration/drive_model_file.h"
#include "runtime/configuration/ethercat_config.h"
#include "runtime/configuration/hidden_effect.h"
#include "runtime/configuration/plausibility_config.h"
#include "runtime/configuration/regular_file.h"
#include "runtime/configuration/scene_config.h"
#include "runtime/configuration/toml_reader.h"

namespace operation {
namespace {

using runtime::TomlTable;
using Models = std::vector<runtime::RecordingFile::Attachment>;

std::chrono::nanoseconds to_nanoseconds(double seconds) {
  return std::chrono::nanoseconds(std::llround(seconds * 1e9));
}

void read_duration(TomlTable& table, std::string_view key, std::chrono::nanoseconds& value,
                   const runtime::NumberRules& rules) {
  double seconds = std::chrono::duration<double>(value).count();
  table.number(key, seconds, rules);
  value = to_nanoseconds(seconds);
}

void read_loop(TomlTable table, Config& config) {
  // Below 100 Hz the filters do not work; above 1 kHz the youBot's own controllers fail.
  read_duration(table, "period_s", config.cycle.period, {.min = 0.001, .max = 0.01});
  read_duration(table, "command_timeout_s", config.cycle.command_timeout, {.min = 0.005, .max = 2.0});
  // youbotctl sends a request at least every 0.2 s.
  read_duration(table, "commander_timeout_s", config.commander_timeout, {.min = 0.3, .max = 10});
  table.integer("priority", config.real_time.priority, {.min = 1, .max = 99});
  int cpu = -1;
  table.integer("cpu", cpu, {.min = 0, .max = 1023});
  if (cpu >= 0) config.real_time.cpu = cpu;
}

void read_geometry(TomlTable table, control::BaseGeometry& geometry) {
  table.number("wheel_radius_m", geometry.wheel_radius_m, {.min = 0.01, .max = 0.2});
  table.number("wheelbase_m", geometry.wheelbase_m, {.min = 0.1, .max = 2.0});
  table.number("track_m", geometry.track_m, {.min = 0.1, .max = 2.0});
}

/// The base has the same gain along x and y.
void read_gain(TomlTable& table, std::string_view linear_key, double linear_max, std::string_view turning_key,
               double turning_max, control::PlanarVector& gain) {
  double linear = gain[0];
  double turning = gain[2];
  table.number(linear_key, linear, {.min = 0, .max = linear_max});
  table.number(turning_key, turning, {.min = 0, .max = turning_max});
  gain = {linear, linear, turning};
}

void read_controller(TomlTable table, control::BaseController::Config& controller) {
  read_gain(table, "stiffness_N_per_m", 5000, "turning_stiffness_Nm_per_rad", 1000, controller.stiffness);
  read_gain(table, "damping_N_s_per_m", 2000, "turning_damping_Nm_s_per_rad", 500, controller.damping);
  read_gain(table, "feedforward_mass_kg", 200, "feedforward_inertia_kg_m2", 50,
            controller.feedforward_inertia);
}

void read_limits(TomlTable table, Cycle::Config& cycle) {
  control::SetpointLimits& linear = cycle.setpoint.linear;
  control::SetpointLimits& turning = cycle.setpoint.turning;
  table.number("setpoint_m_per_s", linear.speed, {.min = 0.01, .max = 5});
  table.number("setpoint_m_per_s2", linear.acceleration, {.min = 0.01, .max = 50});
  table.number("setpoint_m_per_s3", linear.jerk, {.min = 1, .max = 50'000});
  table.number("setpoint_rad_per_s", turning.speed, {.min = 0.01, .max = 10});
  table.number("setpoint_rad_per_s2", turning.acceleration, {.min = 0.01, .max = 100});
  table.number("setpoint_rad_per_s3", turning.jerk, {.min = 1, .max = 100'000});
  // Above zero: otherwise the base obeys and never moves, without a fault.
  table.number("force_N", cycle.controller.wrench_limits.force_N, {.min = 0.1, .max = 200});
  table.number("moment_Nm", cycle.controller.wrench_limits.moment_Nm, {.min = 0.01, .max = 50});
  table.number("wheel_torque_Nm", cycle.controller.torque_limit_Nm, {.min = 0.01, .max = 2.5});
  table.number("wheel_speed_rad_per_s", cycle.wheel_speed_limit_rad_per_s, {.min = 0.1, .max = 30});
  table.number("torque_rate_per_s", cycle.torque_rate_per_s, {.min = 1, .max = 1000});
  table.number("following_error_m", cycle.following_error_m, {.min = 0.005, .max = 5});
  table.number("following_error_rad", cycle.following_error_rad, {.min = 0.01, .max = 10});
}

/// "base_x_m = [-1, 3]": lower and upper limit.
void read_walls(TomlTable& table, std::string_view key, double& lower_m, double& upper_m) {
  std::array<double, 2> walls_m{lower_m, upper_m};
  table.numbers(key, walls_m, {.min = -100, .max = 100});
  if (!(walls_m[0] < walls_m[1])) return table.refuse(key, "has no room between its two walls");
  lower_m = walls_m[0];
  upper_m = walls_m[1];
}

void read_workspace(TomlTable table, control::Workspace& workspace) {
  Eigen::AlignedBox2d& base = workspace.base_W_m;
  Eigen::AlignedBox3d& tip = workspace.tip_W_m;
  read_walls(table, "base_x_m", base.min().x(), base.max().x());
  read_walls(table, "base_y_m", base.min().y(), base.max().y());
  read_walls(table, "tip_x_m", tip.min().x(), tip.max().x());
  read_walls(table, "tip_y_m", tip.min().y(), tip.max().y());
  read_walls(table, "tip_z_m", tip.min().z(), tip.max().z());
  for (const auto& [key, axis] : {std::pair{"base_x_m", 0}, std::pair{"base_y_m", 1}})
    if (base.min()[axis] > 0 || base.max()[axis] < 0)
      table.refuse(key, "leaves out the origin, where the base stands at the start");
}

/// Driving diagonally turns a wheel up to √2 times as fast as straight ahead, and a turn adds to either.
double fastest_wheel_rad_per_s(const control::BasePath::Plan& plan, const control::BaseGeometry& geometry) {
  constexpr double kPeakOfMean = 15.0 / 8;  // of the polynomial on each segment, see control::BasePath
  const control::LinkMap map = control::LinkMap::with_geometry(geometry);
  double fastest_rad_per_s = 0;
  for (const control::PlanarVector& displacement_B : plan.displacements_B) {
    const control::BasePath leg(
        {.start = {}, .displacements_B = {displacement_B}, .rest_s = 0, .limits = plan.limits});
    const control::PlanarVector peak_B = displacement_B * kPeakOfMean / leg.duration_s();
    fastest_rad_per_s = std::max(fastest_rad_per_s, map.wheel_velocity(peak_B).cwiseAbs().maxCoeff());
  }
  return fastest_rad_per_s;
}

/// A path is known before anything moves, so it is checked here.
void check_path(const Config& config, TomlTable& table) {
  const control::BasePath::Plan& plan = config.path;
  // Already rejected.
  if (std::any_of(plan.displacements_B.begin(), plan.displacements_B.end(),
                  [](const control::PlanarVector& displacement) { return displacement.isZero(); }))
    return;
  if (const auto at = first_outside(plan, config.cycle.workspace.base_W_m))
    table.refuse("leg",
                 fmt::format("leads out of [workspace], at x = {:.2f} m, y = {:.2f} m", at->x_m, at->y_m));
  const double fastest_rad_per_s = fastest_wheel_rad_per_s(plan, config.cycle.controller.geometry);
  if (fastest_rad_per_s > kWheelSpeedShare * config.cycle.wheel_speed_limit_rad_per_s)
    table.refuse("leg", fmt::format("turns a wheel at {:.1f} rad/s, faster than 95 % of "
                                    "'limits.wheel_speed_rad_per_s': lower 'path.speed_m_per_s' or "
                                    "'path.turn_speed_rad_per_s'",
                                    fastest_rad_per_s));
}

/// Whether a name leads out of `folder`, directly or through a link in it.
bool leaves(const std::filesystem::path& folder, const std::filesystem::path& name) {
  if (name.is_absolute() || std::find(name.begin(), name.end(), "..") != name.end()) return true;
  const std::filesystem::path home = std::filesystem::weakly_canonical(folder.empty() ? "." : folder);
  const std::filesystem::path relative =
      std::filesystem::weakly_canonical(home / name).lexically_relative(home);
  return relative.empty() || *relative.begin() == "..";
}

/// Whether only root, the user of this program or the owner of the configuration's folder can have written
/// it.
bool is_trusted(const std::filesystem::path& folder, const runtime::RegularFile& file) {
  struct stat home {};
  const bool known =
      file.owner() == 0 || file.owner() == ::geteuid() ||
      (::stat(folder.empty() ? "." : folder.c_str(), &home) == 0 && file.owner() == home.st_uid);
  return known && !file.group_or_others_may_write();
}

/// Model files are relative to the file that names them. Errors in them are reported with their own lines.
std::optional<model::effects::DriveModel> read_model(TomlTable& table, std::string_view key,
                                                     const std::filesystem::path& folder,
                                                     const std::string& name) {
  const auto refuse = [&](const std::string& complaint) {
    table.refuse(key, "names a " + complaint);
    return std::nullopt;
  };
  if (table.is_set(key) && leaves(folder, name))
    return refuse("file outside the configuration's folder, which only the file itself may: " + name);
  const std::filesystem::path path = folder / name;
  try {
    if (!table.is_set(key)) return runtime::read_drive_model(path);
    // Checks the open file, so that the path cannot change in between.
    const runtime::RegularFile file(path);
    if (!is_trusted(folder, file))
      return refuse(
          "file that others can write, by its owner or its rights, which only the file itself may: " + name);
    return runtime::read_drive_model(path, file);
  } catch (const runtime::ConfigError& error) {
    for (const std::string& problem : error.problems()) refuse("drive model that cannot be used: " + problem);
    return std::nullopt;
  } catch (const std::runtime_error& error) {
    return refuse("drive model that cannot be used: " + path.string() + ": " + error.what());
  }
}

/// Attachments are named after the file that the configuration names, each file once. Through a link, two
/// files can have one name; both are kept, so that neither is lost without a report.
void keep(const std::filesystem::path& written, const std::string& text, Models& models) {
  const std::string name = written.lexically_normal().generic_string();
  const bool is_kept = std::ranges::any_of(
      models, [&](const auto& model) { return model.name == name && model.text == text; });
  if (!is_kept) models.push_back({name, text});
}

void keep(const ArmFile& file, Models& models) {
  const std::filesystem::path name = file.name;
  keep(name, file.text, models);
  keep(name.parent_path() / kArmFileUrdf, std::string(control::youbot_urdf()), models);
}

/// Names of a drive model for each wheel; empty if the key is missing or refused.
std::vector<std::string> four_names(TomlTable& table, std::string_view key) {
  std::vector<std::string> names;
  table.texts(key, names);
  if (names.empty() || names.size() == 4) return names;
  table.refuse(key,
               "should have a drive model for each of the 4 wheels, found " + std::to_string(names.size()));
  return {};
}

/// A curve that drops below zero within the wheels' speed range is not friction: its compensation would drive
/// them.
void read_wheel_models(TomlTable& table, const std::filesystem::path& folder, double top_speed_rad_per_s,
                       control::BaseController::Config& controller, Models& models) {
  constexpr std::string_view kKey = "models";
  std::vector<model::JointResistance> wheels;
  for (const std::string& name : four_names(table, kKey)) {
    const auto model = read_model(table, kKey, folder, name);
    if (!model) continue;
    keep(name, runtime::drive_model_text(*model), models);
    const auto refuse = [&](const std::string& why) {
      table.refuse(kKey,
                   "names a drive model that cannot be compensated up to 'limits.wheel_speed_rad_per_s': " +
                       (folder / name).string() + ": " + why);
    };
    if (const std::string why = runtime::driving_friction(*model, top_speed_rad_per_s); !why.empty()) {
      refuse(why);
      continue;
    }
    try {
      wheels.push_back(model::effects::resistance_of(*model));
    } catch (const std::invalid_argument& error) {
      refuse(error.what());
    }
  }
  if (wheels.size() == 4) controller.wheels = {wheels[0], wheels[1], wheels[2], wheels[3]};
}

void read_adaptation(TomlTable& table, control::BaseController::Config& controller) {
  control::FrictionAdaptation::Config& adaptation = controller.adaptation;
  adaptation.inertia = controller.feedforward_inertia;
  adaptation.full_command_Nm = controller.compensator.full_command_Nm;
  table.boolean("adapt", controller.adapt);
  table.number("adapt_up_to", adaptation.greatest, {.min = 1, .max = 3.5});
  table.numbers("factors", controller.friction_factor, {.min = adaptation.least, .max = 3.5});
  if (!controller.adapt) return;
  // The largest torque that the spring commands a wheel along one axis.
  const double command_Nm = controller.wrench_limits.force_N * controller.geometry.wheel_radius_m / 4;
  if (*std::ranges::max_element(controller.friction_factor) > adaptation.greatest)
    table.refuse("factors", "begin above 'adapt_up_to'");
  else if (!(adaptation.inertia.array() > 0).all())
    table.refuse("adapt",
                 "needs the inertia of the base: 'controller.feedforward_mass_kg' and "
                 "'controller.feedforward_inertia_kg_m2' above zero");
  else if (controller.compensator.margin == 0)
    table.refuse("adapt", "acts through the compensation, whose 'margin' is zero");
  else if (controller.compensator.full_command_Nm >= command_Nm)
    table.refuse("adapt", "needs 'full_command_Nm' below the torque that 'limits.force_N' gives a wheel, " +
                              std::to_string(command_Nm) + " N·m");
}

void read_compensation(TomlTable& table, const std::filesystem::path& folder, double top_speed_rad_per_s,
                       control::BaseController::Config& controller, Models& models) {
  table.boolean("enabled", controller.compensate_friction);
  table.number("margin", controller.compensator.margin, {.min = 0, .max = 1});
  table.number("full_command_Nm", controller.compensator.full_command_Nm, {.min = 1e-4, .max = 1});
  table.number("blend_speed_rad_per_s", controller.observer.blend_speed_rad_per_s,
               {.min = 0.005, .max = 0.2});
  table.number("filter_cutoff_rad_per_s", controller.observer.filter.cutoff_rad_per_s,
               {.min = 5, .max = 1000});
  table.number("filter_damping", controller.observer.filter.damping, {.min = 0.3, .max = 3});
  read_wheel_models(table, folder, top_speed_rad_per_s, controller, models);
  read_adaptation(table, controller);
}

void read_path(TomlTable table, control::BasePath::Plan& path) {
  control::BasePath::Limits& limits = path.limits;
  table.number("speed_m_per_s", limits.speed_m_per_s, {.min = 0.001, .max = 0.8});
  table.number("acceleration_m_per_s2", limits.acceleration_m_per_s2, {.min = 0.001, .max = 5});
  table.number("turn_speed_rad_per_s", limits.turn_speed_rad_per_s, {.min = 0.001, .max = 3});
  table.number("turn_acceleration_rad_per_s2", limits.turn_acceleration_rad_per_s2,
               {.min = 0.001, .max = 20});
  table.number("rest_s", path.rest_s, {.min = 0, .max = 60});
  for (TomlTable& leg : table.tables("leg")) {
    control::PlanarVector displacement = control::PlanarVector::Zero();
    bool rejected = false;
    const auto read = [&](std::string_view key, double& value) {
      double given = std::numeric_limits<double>::quiet_NaN();  // stays if it is missing or rejected
      leg.number(key, given, {.min = -100, .max = 100});
      if (!std::isnan(given))
        value = given;
      else
        rejected = rejected || leg.has(key);
    };
    read("forward_m", displacement[0]);
    read("left_m", displacement[1]);
    read("turn_rad", displacement[2]);
    if (displacement.isZero() && !rejected)
      leg.refuse("forward_m", "and 'left_m' and 'turn_rad' are all zero: a leg goes somewhere");
    path.displacements_B.push_back(displacement);
  }
}

void read_simulated_wheels(TomlTable& table, const std::filesystem::path& folder,
                           sim::BaseParameters& simulation, Models& models) {
  std::string model;
  int seed = -1;
  table.text("model", model);
  table.integer("hidden_effect", seed, {.min = 0, .max = runtime::HiddenEffect::kMaxSeed});
  const std::vector<std::string> each = four_names(table, "models");
  if (!model.empty() && !each.empty())
    return table.refuse("models", "and 'simulation.model' exclude each other: wheels follow one of them");
  if ((!model.empty() || !each.empty()) && seed >= 0)
    return table.refuse("hidden_effect", std::string("and 'simulation.model") + (each.empty() ? "'" : "s'") +
                                             " exclude each other: wheels follow one of them");
  const auto follow = [&](std::string_view key, const std::string& name) {
    const auto read = read_model(table, key, folder, name);
    if (!read) return;
    keep(name, runtime::drive_model_text(*read), models);
    simulation.models.push_back(*read);
  };
  if (!model.empty()) follow("model", model);
  for (const std::string& name : each) follow("models", name);
  if (seed >= 0) simulation.models = {runtime::HiddenEffect(static_cast<std::uint64_t>(seed)).wheel_model()};
}

void read_floor(TomlTable& table, sim::Floor& floor) {
  /// Each wheel looks through all of them in each step.
  constexpr std::size_t kMaxPatches = 16;
  table.numbers("slope", std::span(floor.slope_W.data(), 2), {.min = -0.3, .max = 0.3});
  for (TomlTable& patch : table.tables("patch", {.most = kMaxPatches})) {
    sim::FloorPatch& read = floor.patches.emplace_back();
    patch.numbers("from_m", std::span(read.from_m.data(), 2), {.min = -1000, .max = 1000});
    patch.numbers("to_m", std::span(read.to_m.data(), 2), {.min = -1000, .max = 1000});
    if (!(read.from_m.array() < read.to_m.array()).all())
      patch.refuse("to_m", "is not above 'from_m' in x and y");
    patch.number("grip", read.grip, {.min = 0, .max = 5});
    patch.number("resistance", read.resistance, {.min = 0, .max = 100});
  }
}

/// Returns the robot file of the simulated arm, if there is one.
std::optional<ArmFile> read_simulation(TomlTable& table, const std::filesystem::path& folder,
                                       runtime::RobotOptions& robot, Models& models) {
  sim::BaseParameters& simulation = robot.simulation;
  table.boolean("on_ground", simulation.on_ground);
  table.number("mass_kg", simulation.mass_kg, {.min = 1, .max = 200});
  table.number("yaw_inertia_kg_m2", simulation.yaw_inertia_kg_m2, {.min = 0.05, .max = 50});
  table.number("wheel_inertia_kg_m2", simulation.drive.load_inertia_kg_m2, {.min = 1e-5, .max = 1});
  table.numbers("loaded_friction_scale", simulation.loaded_friction_scale, {.min = 0.01, .max = 20});
  table.number("roller_grip", simulation.roller_grip, {.min = 0, .max = 2});
  table.number("roller_resistance", simulation.roller_resistance, {.min = 0, .max = 0.5});
  table.number("centre_of_mass_height_m", simulation.centre_of_mass_height_m, {.min = 0, .max = 1});
  read_floor(table, simulation.floor);
  read_duration(table, "step_s", simulation.step, {.min = 1e-6, .max = 2e-4});
  int seed = static_cast<int>(simulation.noise_seed);
  table.integer("noise_seed", seed, {.min = 0});
  simulation.noise_seed = static_cast<std::uint64_t>(seed);
  read_simulated_wheels(table, folder, simulation, models);
  return read_arm_file(table, "robot_file", folder);
}

/// Settings that teleoperation shares with the rest.
void complete(control::Teleoperation::Config& teleoperation, const Config& config) {
  const double period_s = std::chrono::duration<double>(config.cycle.period).count();
  teleoperation.period_s = teleoperation.robot.period_s = teleoperation.mapping.period_s =
      teleoperation.smoothing.period_s = teleoperation.presence.period_s = period_s;
  teleoperation.robot.base = static_cast<const control::BaseDrive::Config&>(config.cycle.controller);
  // What the arm's motion does to the base would be taken for friction.
  teleoperation.robot.base.adapt = false;
  teleoperation.workspace = config.cycle.workspace;
  teleoperation.wheel_speed_limit_rad_per_s = config.cycle.wheel_speed_limit_rad_per_s;
  teleoperation.tank.force_rate_N_per_s = config.haptic.limits.slew_N_per_s;
  teleoperation.tank.device_mass_kg = teleoperation.presence.device_mass_kg;
}

/// The hand's end of the link has the same handle.
void complete(runtime::LinkOptions& link, const Config& config) {
  link.presence = config.teleoperation.presence;
  link.port.tank.force_rate_N_per_s = config.haptic.limits.slew_N_per_s;
  link.port.tank.device_mass_kg = link.presence.device_mass_kg;
}

/// At the key of the start that a setting changed, or else at one that the file has.
void refuse_start(TomlTable teleoperation, const std::string& why) {
  TomlTable start = teleoperation.table("start");
  const std::array<std::string_view, 2> keys{"position_m", "pitch_deg"};
  const auto* key = std::ranges::find_if(keys, [&](std::string_view name) { return start.is_set(name); });
  if (key == keys.end())
    key = std::ranges::find_if(keys, [&](std::string_view name) { return start.has(name); });
  start.refuse(key != keys.end() ? *key : keys.front(), "is refused: " + why);
}

/// Whether the arm reaches its start, within the workspace.
void check_teleoperation(const control::Teleoperation::Config& teleoperation, TomlTable& root,
                         const runtime::TomlFile& file) {
  try {
    const control::Teleoperation possible(teleoperation);
  } catch (const control::UnreachableStart& error) {
    refuse_start(root.table("teleoperation"), error.what());
    file.finish();
  } catch (const std::invalid_argument& error) {
    root.refuse("teleoperation", fmt::format("is refused: {}", error.what()));
    file.finish();
  }
}

}  // namespace

std::optional<control::PlanarPose> first_outside(const control::BasePath::Plan& plan,
                                                 const Eigen::AlignedBox2d& base_W_m) {
  constexpr int kSamplesPerLeg = 500;
  const control::BasePath path(plan);
  const auto samples = kSamplesPerLeg * static_cast<int>(plan.displacements_B.size());
  for (int i = 1; i <= samples; ++i) {
    const control::PlanarPose at = path.at(path.duration_s() * i / samples).X_WB;
    if (!base_W_m.contains(Eigen::Vector2d(at.x_m, at.y_m))) return at;
  }
  return std::nullopt;
}

std::vector<std::string> arm_lines(const Config& config) {
  std::vector<std::string> lines;
  if (config.role == runtime::Role::kOperator) return lines;  // it has neither arm
  const auto add = [&](const std::string& whose, const ArmFile& file, const runtime::ArmModel& model) {
    lines.push_back(whose + ": robot file " + file.path.string());
    for (const std::string& line : runtime::arm_model_lines(model)) lines.push_back(whose + ": " + line);
  };
  const control::WholeBodyController::Config& robot = config.teleoperation.robot;
  if (config.arm_file)
    add("arm", *config.arm_file,
        {.changes = robot.model,
         .friction = robot.arm_friction,
         .rotor_inertia_kg_m2 = robot.rotor_inertia_kg_m2,
         .scaled_columns = config.arm_file->model.scaled_columns});
  if (config.simulated_arm_file)
    add("simulated arm", *config.simulated_arm_file, config.simulated_arm_file->model);
  return lines;
}

Config load_config(const std::filesystem::path& file, const std::map<std::string, std::string>& settings) {
  Config config;
  runtime::TomlFile toml = runtime::TomlFile::parse(file);
  for (const auto& [key, value] : settings) toml.set(key, value);
  TomlTable root = toml.root();
  // Every key has a default, but a file without any key is a mistake that would enable a robot.
  if (root.empty())
    throw runtime::ConfigError({file.string() + ":1: holds no key; demo.toml and teleop.toml show them all"});
  for (const char* key :
       {"role", "link", "robot", "loop", "geometry", "ethercat", "can", "simulation", "scene"})
    config.opened_once[key] = root.written(key);
  config.opened_once["haptic"] = root.written("haptic", "device");
  config.opened_once[kHapticDevice] = root.table("haptic").written("device");
  using runtime::Role;
  root.choice("role", config.role,
              {{"both", Role::kBoth}, {"robot", Role::kRobot}, {"operator", Role::kOperator}});
  root.text("robot", config.robot.name);
  // The cycle rejects a bench rig, can:IFACE: it reports the number of wheels it needs.
  if (!runtime::is_robot_name(config.robot.name))
    root.refuse("robot", "is none of loopback, wire, ethercat:IFACE");
  TomlTable loop = root.table("loop");
  TomlTable limits = root.table("limits");
  TomlTable compensation = root.table("compensation");
  TomlTable path = root.table("path");
  read_loop(loop, config);
  read_geometry(root.table("geometry"), config.cycle.controller.geometry);
  read_controller(root.table("controller"), config.cycle.controller);
  read_limits(limits, config.cycle);
  read_compensation(compensation, file.parent_path(), config.cycle.wheel_speed_limit_rad_per_s,
                    config.cycle.controller, config.models);
  read_path(path, config.path);
  read_workspace(root.table("workspace"), config.cycle.workspace);
  TomlTable simulation = root.table("simulation");
  config.simulated_arm_file = read_simulation(simulation, file.parent_path(), config.robot, config.models);
  if (config.simulated_arm_file) {
    keep(*config.simulated_arm_file, config.models);
    config.robot.arm = config.simulated_arm_file->model;
    config.opened_once["simulation"] += config.simulated_arm_file->text;
  }
  TomlTable haptic = root.table("haptic");
  runtime::read_haptic(haptic, file.parent_path(), config.haptic);
  TomlTable link = root.table("link");
  runtime::read_link(link, config.role, file.parent_path(), config.haptic.link);
  if (config.role == Role::kRobot) {
    if (haptic.has("device"))
      haptic.refuse("device", "is given, but with role = \"robot\" the device is the operator's station's");
    config.haptic.name = runtime::kRemoteHaptic;
  }
  config.teleoperated = root.has("teleoperation") || config.role == Role::kRobot;
  config.arm_file = read_teleoperation(root.table("teleoperation"), file.parent_path(), config.teleoperation);
  if (config.arm_file) keep(*config.arm_file, config.models);
  runtime::read_scene(root.table("scene"), config.robot.scene);
  TomlTable ethercat = root.table("ethercat");
  runtime::read_ethercat(ethercat, config.cycle.period, config.robot.ethercat);
  TomlTable can = root.table("can");
  runtime::read_can(can, config.robot.can);
  if (config.robot.ethercat.home_arms) config.cycle.enable_timeout = runtime::kHomingTimeout;

  // Constraints between values.
  if (config.robot.arm && config.robot.ethercat.kind != hal::YoubotKind::kBaseAndArm)
    simulation.refuse("robot_file",
                      "needs 'ethercat.kind' = \"base+arm\": no other simulated arm has weight");
  if (config.robot.ethercat.kind == hal::YoubotKind::kArm)
    ethercat.refuse("kind", "is 'arm', but it is the base that drives; youbot-bench measures an arm alone");
  const Cycle::Config& cycle = config.cycle;
  const double period_s = std::chrono::duration<double>(cycle.period).count();
  // The cycle that waited in vain ends within a period, and the next one starts within another.
  const std::chrono::nanoseconds lost_frame = config.robot.ethercat.frame_timeout + 2 * cycle.period;
  if (cycle.command_timeout < 2 * cycle.period)
    loop.refuse("command_timeout_s", "is less than two periods");
  else if (cycle.command_timeout > config.commander_timeout)
    loop.refuse(
        "command_timeout_s",
        "is more than 'loop.commander_timeout_s': the base would follow an old set-point for longer than "
        "a silent commander is waited for");
  else if (lost_frame > cycle.command_timeout)
    ethercat.refuse(
        "frame_timeout_s",
        "and two periods are more than 'loop.command_timeout_s': one lost frame would stop the robot");
  const double cutoff_rad_per_s = cycle.controller.observer.filter.cutoff_rad_per_s;
  if (cutoff_rad_per_s * period_s > 1)
    compensation.refuse("filter_cutoff_rad_per_s",
                        "is too fast for 'loop.period_s': their product is above 1");
  runtime::read_plausibility(root.table("plausibility"), config.cycle.checks_off);
  check_path(config, path);
  toml.finish();

  config.cycle.controller.observer.filter.period_s =
      std::chrono::duration<double>(config.cycle.period).count();
  config.robot.simulation.geometry = config.cycle.controller.geometry;
  config.cycle.arm = config.teleoperation.robot.model;
  complete(config.teleoperation, config);
  complete(config.haptic.link, config);
  if (config.teleoperated) check_teleoperation(config.teleoperation, root, toml);
  if (!settings.empty()) require_no_weaker(config, load_config(file), file);
  return config;
}

}  // namespace operation
