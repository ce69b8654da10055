#include "apps/youbot_bench/experiment_request.h"

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstdio>
#include <memory>
#include <optional>
#include <sstream>
#include <stdexcept>
#include <string_view>
#include <type_traits>
#include <utility>

#include "apps/youbot_bench/confirm.h"
#include "apps/youbot_bench/experiment_runner.h"
#include "apps/youbot_bench/progress.h"
#include "hal/axis_scale.h"
#include "hal/youbot_axes.h"
#include "model/effects/dissipation.h"
#include "model/effects/resistance.h"
#include "model/friction/any_law.h"
#include "model/friction/law_compensator.h"
#include "model/friction/sliding_table.h"
#include "runtime/configuration/can_config.h"
#include "runtime/configuration/drive_model_file.h"
#include "runtime/configuration/ethercat_config.h"
#include "runtime/configuration/plausibility_config.h"
#include "runtime/configuration/shared_tables.h"
#include "runtime/configuration/toml_reader.h"
#include "runtime/log.h"
#include "runtime/program/build_info.h"
#include "runtime/program/exit_code.h"
#include "runtime/program/stop_on_signals.h"

namespace youbot_bench {
namespace {

using identification::experiments::CompensationConfig;
using identification::experiments::DahlConfig;
using identification::experiments::JointExperiment;
using identification::experiments::MultisineConfig;
using identification::experiments::Parameter;
using identification::experiments::PreslidingConfig;
using identification::experiments::ReversalsConfig;
using identification::experiments::StaircaseConfig;
using identification::experiments::SteadyStateConfig;
using identification::experiments::StickSlipConfig;
using identification::experiments::TorqueRampConfig;

std::optional<std::uint64_t> hidden_effect_of(const ExperimentSettings& config) {
  if (config.hidden_effect < 0) return std::nullopt;
  return static_cast<std::uint64_t>(config.hidden_effect);
}

std::vector<std::string> split(const std::string& list) {
  std::vector<std::string> parts;
  std::istringstream text(list);
  for (std::string part; std::getline(text, part, ',');)
    if (!part.empty()) parts.push_back(part);
  return parts;
}

/// @throws std::invalid_argument for a text that is not a number.
std::optional<double> start_of(const ExperimentSettings& config) {
  if (config.start_rad.empty()) return std::nullopt;
  const char* const end = config.start_rad.data() + config.start_rad.size();
  double start_rad = 0.0;
  const auto [rest, error] = std::from_chars(config.start_rad.data(), end, start_rad);
  if (error != std::errc() || rest != end || !std::isfinite(start_rad))
    throw std::invalid_argument("start_rad = '" + config.start_rad + "', expected a number");
  return start_rad;
}

template <typename Value>
std::string toml_text(const Value& value) {
  if constexpr (std::is_same_v<Value, std::string>)
    return runtime::toml_string(value);
  else
    return fmt::format("{}", value);
}

template <typename Value>
void read_toml(runtime::TomlTable& table, const Parameter& parameter, Value& value) {
  if constexpr (std::is_same_v<Value, std::string>)
    table.text(parameter.key, value);
  else if constexpr (std::is_same_v<Value, int>)
    table.integer(parameter.key, value, {.min = parameter.min, .max = parameter.max});
  else
    table.number(parameter.key, value, {.min = parameter.min, .max = parameter.max});
}

/// One tick of the encoder at the joint.
double encoder_step_rad(const std::string& joint) {
  hal::AxisConstants constants = hal::kWheelAxis.constants;
  if (joint.starts_with("arm") && joint.back() >= '1' && joint.back() <= '5')
    constants = hal::kArmAxes[static_cast<std::size_t>(joint.back() - '1')].constants;
  return hal::AxisScale(constants).position_resolution_rad();
}

/// Makes file paths absolute, so that the experiment can be resumed from anywhere.
template <typename Config>
void make_paths_absolute(Config& /*config*/) {}

using Made = std::unique_ptr<JointExperiment>;
Made make(const SteadyStateConfig& config, const std::string& /*joint*/, double period_s) {
  return std::make_unique<identification::experiments::SteadyState>(config, period_s);
}
Made make(const TorqueRampConfig& config, const std::string& joint, double period_s) {
  return std::make_unique<identification::experiments::TorqueRamp>(config, encoder_step_rad(joint), period_s);
}
Made make(const DahlConfig& config, const std::string& joint, double /*period_s*/) {
  return std::make_unique<identification::experiments::Dahl>(config, encoder_step_rad(joint));
}
Made make(const PreslidingConfig& config, const std::string& /*joint*/, double period_s) {
  return std::make_unique<identification::experiments::TorqueWave>(config, period_s);
}
Made make(const MultisineConfig& config, const std::string& /*joint*/, double period_s) {
  return std::make_unique<identification::experiments::TorqueWave>(config, period_s);
}
Made make(const StickSlipConfig& config, const std::string& /*joint*/, double /*period_s*/) {
  return std::make_unique<identification::experiments::StickSlip>(config);
}
bool is_law(const std::string& name) {
  return std::ranges::any_of(model::friction::law_descriptions(),
                             [&](const auto& law) { return law.name == name; });
}

void make_paths_absolute(CompensationConfig& config) {
  if (!config.compensator.empty() && !is_law(config.compensator))
    config.compensator = std::filesystem::absolute(config.compensator).string();
}

/// Friction model of the compensator.
model::friction::SlidingTable compensated_friction(const std::string& compensator, int wheel) {
  if (compensator.empty()) return model::friction::wheel_table(wheel);
  if (is_law(compensator)) return model::friction::law_table(model::friction::make_law(compensator));
  if (!std::filesystem::exists(compensator))
    throw std::invalid_argument("--compensator: " + compensator +
                                " is neither a file nor a law; identify --help lists the laws");
  const model::effects::DriveModel model = runtime::read_drive_model(compensator);
  if (const std::string why = runtime::driving_friction(model, model::effects::kUsualTopSpeed_rad_per_s);
      !why.empty())
    throw std::invalid_argument("--compensator: " + compensator + ": " + why);
  try {
    return model::effects::resistance_of(model).sliding;
  } catch (const std::invalid_argument& error) {
    throw std::invalid_argument("--compensator: " + compensator + ": " + error.what());
  }
}

/// Relative to the curve measured on this wheel. The observer blends from rest on.
double passive_gain_of(const CompensationConfig& config, const model::friction::SlidingTable& friction,
                       int wheel) {
  const model::friction::LawCompensator help(friction, {.margin = std::min(config.margin, 0.999),
                                                        .blend_speed_rad_per_s = config.blend_speed_rad_per_s,
                                                        .quiet_speed_rad_per_s = 0});
  return model::friction::max_passive_gain(
      model::friction::make_law("measured_wheel", {{"wheel", static_cast<double>(wheel)}}), help);
}

Made make(const CompensationConfig& config, const std::string& joint, double period_s) {
  if (!joint.starts_with("wheel-") || joint.back() < '1' || joint.back() > '4')
    throw std::invalid_argument("compensation: no friction curve was measured for " + joint +
                                ", only for wheel-1 to wheel-4");
  const int wheel = joint.back() - '0';
  model::friction::SlidingTable friction = compensated_friction(config.compensator, wheel);
  const double gain = passive_gain_of(config, friction, wheel);
  return std::make_unique<identification::experiments::Compensation>(config, std::move(friction), gain,
                                                                     period_s);
}
Made make(const StaircaseConfig& config, const std::string& /*joint*/, double /*period_s*/) {
  return std::make_unique<identification::experiments::Staircase>(config);
}
Made make(const ReversalsConfig& config, const std::string& /*joint*/, double /*period_s*/) {
  return std::make_unique<identification::experiments::Reversals>(config);
}

template <typename Config>
void read(Config& config, runtime::TomlTable table) {
  config.visit([&table](const Parameter& parameter, auto& value) { read_toml(table, parameter, value); });
}

template <typename Config>
std::string written(Config config) {
  std::string text;
  config.visit([&text](const Parameter& parameter, const auto& value) {
    text += fmt::format("{} = {}  # {}\n", parameter.key, toml_text(value), parameter.help);
  });
  return text;
}

/// The file that reproduces the experiment.
std::string configuration(const ExperimentRequest& request) {
  return fmt::format(
      "# youbot-bench {0} --config THIS_FILE --out DIR makes it again\n"
      "# software: {1}\n"
      "experiment = \"{0}\"\n{2}\n[parameters]\n{3}\n{4}\n{5}\n{6}",
      request.name, runtime::build_version(), written(request.settings),
      std::visit([](const auto& config) { return written(config); }, request.parameters),
      runtime::ethercat_text(request.ethercat), runtime::can_text(request.can),
      runtime::plausibility_text(request.checks_off));
}

Confirmation confirmation(const ExperimentRequest& request) {
  const bool arm = request.settings.joints.find("arm") != std::string::npos;
  if (arm)
    return {.robot = request.settings.robot,
            .what = request.ethercat.home_arms
                        ? request.settings.joints + " will turn, and the arm goes to its end stops"
                        : request.settings.joints + " will turn",
            .question = "Is the arm free to move, with no person within its reach?",
            .answer = "free to move",
            .otherwise = "Clear the arm's reach and add --yes"};
  return {.robot = request.settings.robot,
          .what = request.ethercat.home_arms ? "the joints will turn, and the arm goes to its end stops"
                                             : "the joints will turn",
          .question = "Are the wheels off the ground?",
          .answer = "off the ground",
          .otherwise = "Lift the wheels off the ground and add --yes"};
}

int report(const ExperimentRequest& request, const ExperimentOutcome& outcome) {
  const std::filesystem::path& directory = request.directory;
  for (const std::string& problem : outcome.not_real_time) spdlog::warn("not real-time: {}", problem);
  for (const std::string& note : runtime::notes_on_silent(outcome.once_silent_checks))
    spdlog::warn("{}", note);
  if (!request.quiet) {
    std::printf("%s: %d of %d measurements, %s of robot time in %s\n", request.name, outcome.finished,
                outcome.planned,
                duration_text(std::chrono::duration<double>(outcome.robot_time).count()).c_str(),
                duration_text(std::chrono::duration<double>(outcome.wall_time).count()).c_str());
    std::printf("recorded in %s\n", (directory / request.name).c_str());
    if (*request.result != 0) std::printf("results in %s\n", (directory / request.result).c_str());
    std::printf("report: %s\n", (directory / "report.html").c_str());
    if (outcome.overruns > 0)
      std::printf("%llu cycles were late\n", static_cast<unsigned long long>(outcome.overruns));
  }
  for (const std::string& problem : outcome.recording_problems) spdlog::error("recording: {}", problem);
  for (const std::string& reason : outcome.not_measured) spdlog::warn("not measured: {}", reason);
  if (!outcome.fault.empty()) {
    spdlog::error("stopped by a fault at {}", outcome.fault);
    spdlog::error("what was recorded until then is in {}", (directory / request.name).string());
    for (const std::string& finding : outcome.robot_report) spdlog::error("robot: {}", finding);
    if (!outcome.frames.empty())
      spdlog::error("the last frames before it are in {}", outcome.frames.string());
  } else if (!request.quiet) {
    for (const std::string& finding : outcome.robot_report) std::printf("robot: %s\n", finding.c_str());
  }
  if (outcome.finished < outcome.planned)
    spdlog::warn("not finished; go on with: youbot-bench {} --resume {}", request.name, directory.string());
  if (!outcome.fault.empty()) return runtime::kExitFault;
  if (!outcome.recording_problems.empty()) return runtime::kExitSetup;
  return outcome.interrupted && outcome.finished < outcome.planned ? runtime::kExitInterrupted
                                                                   : runtime::kExitOk;
}
}  // namespace

std::vector<ExperimentRequest> experiment_requests() {
  return {
      {.name = "steady-state",
       .result = "steady-state-map",
       .about = "friction against velocity: constant velocities, mean torque with its confidence interval",
       .settings = {.record_rate_Hz = 10},
       .parameters = SteadyStateConfig{}},
      {.name = "torque-ramp",
       .result = "torque-ramp-result",
       .about = "slow torque ramps until the first encoder step, and break-away",
       .settings = {.max_speed_rad_per_s = 5, .max_travel_rad = 3},
       .parameters = TorqueRampConfig{}},
      {.name = "dahl",
       .result = "dahl-result",
       .about = "sine of torque below stiction; slope of the torque-displacement loop",
       .settings = {.max_speed_rad_per_s = 2, .max_travel_rad = 0.5},
       .parameters = DahlConfig{}},
      {.name = "presliding",
       .result = "presliding-result",
       .about = "multisine or sine of torque below stiction",
       .settings = {.max_speed_rad_per_s = 2, .max_travel_rad = 0.5},
       .parameters = PreslidingConfig{}},
      {.name = "stick-slip",
       .result = "stick-slip-result",
       .about = "a soft spring in software drags the joint slowly",
       .settings = {.max_speed_rad_per_s = 6, .max_travel_rad = 20},
       .parameters = StickSlipConfig{}},
      {.name = "compensation",
       .result = "compensation-result",
       .about = "swings on a spring after a push, without and with friction compensation",
       .settings = {.max_speed_rad_per_s = 10, .max_travel_rad = 6.3},
       .parameters = CompensationConfig{}},
      {.name = "staircase",
       .about = "steps of torque or velocity in both directions",
       .parameters = StaircaseConfig{}},
      {.name = "reversals",
       .about = "velocity to and fro in triangles that become smaller",
       .parameters = ReversalsConfig{}},
      {.name = "multisine",
       .result = "multisine-result",
       .about = "multisine of torque, low peaks by Schroeder's phases",
       .parameters = MultisineConfig{}},
  };
}

ExperimentRequest experiment_request(const ExperimentParameters& parameters) {
  for (ExperimentRequest& request : experiment_requests())
    if (request.parameters.index() == parameters.index()) {
      request.parameters = parameters;
      return std::move(request);
    }
  throw std::logic_error("an experiment is missing in the list of experiments");
}

void read_experiment(const std::filesystem::path& file, ExperimentRequest& request) {
  runtime::TomlFile toml = runtime::TomlFile::parse(file);
  runtime::TomlTable root = toml.root();
  std::string experiment = request.name;
  root.text("experiment", experiment);
  if (experiment != request.name)
    root.refuse("experiment", "is '" + experiment + "', not '" + request.name + "'");
  read(request.settings, root);
  std::visit([&root](auto& config) { read(config, root.table("parameters")); }, request.parameters);
  runtime::TomlTable ethercat = root.table("ethercat");
  runtime::read_ethercat(ethercat, ExperimentOptions{}.period, request.ethercat);
  runtime::TomlTable can = root.table("can");
  runtime::read_can(can, request.can);
  runtime::read_plausibility(root.table("plausibility"), request.checks_off);
  runtime::leave_to_others(root, {"robot", "ethercat", "can", "plausibility"});
  toml.finish();
}

ExperimentOutcome perform_experiment(ExperimentRequest& request) {
  ExperimentSettings& settings = request.settings;
  settings = identification::experiments::checked(settings);
  std::visit([](auto& config) { make_paths_absolute(config); }, request.parameters);
  const bool simulated = runtime::is_simulated(settings.robot);
  if (!settings.model.empty() && !simulated)
    throw std::invalid_argument("--model: only a simulated robot follows a model, not " + settings.robot);
  if (settings.hidden_effect >= 0 && !simulated)
    throw std::invalid_argument("--hidden-effect: only a simulated robot has one to hide, not " +
                                settings.robot);
  ExperimentOptions options{.joints = split(settings.joints),
                            .directory = request.directory,
                            .resume = request.resume,
                            .virtual_time = request.virtual_time || (simulated && !request.real_time),
                            .quiet = request.quiet,
                            .allow_non_real_time = request.allow_non_real_time,
                            .record_rate_Hz = settings.record_rate_Hz,
                            .max_speed_rad_per_s = settings.max_speed_rad_per_s,
                            .max_travel_rad = settings.max_travel_rad,
                            .start_rad = start_of(settings),
                            .filter_cutoff_rad_per_s = settings.filter_cutoff_rad_per_s,
                            .checks_off = request.checks_off};
  if (request.ethercat.home_arms) options.enable_timeout = runtime::kHomingTimeout;
  runtime::RobotOptions robot;
  robot.name = settings.robot;
  robot.ethercat = request.ethercat;
  robot.can = request.can;
  robot.simulation.on_ground = false;
  robot.simulation.step = std::chrono::nanoseconds(std::llround(settings.simulation_step_s * 1e9));
  robot.simulation.noise_seed = static_cast<std::uint64_t>(settings.noise_seed);
  // Absolute, so that the experiment can be resumed from anywhere.
  std::vector<std::string> models = split(settings.model);
  settings.model.clear();
  for (std::string& model : models)
    settings.model +=
        (settings.model.empty() ? "" : ",") + (model = std::filesystem::absolute(model).string());
  robot.simulation.models = runtime::simulated_wheel_models(models, hidden_effect_of(settings));
  const ExperimentPlan plan{.name = request.name,
                            .result = request.result,
                            .make =
                                [&request](const hal::JointInfo& joint, double period_s) {
                                  return std::visit(
                                      [&](const auto& config) { return make(config, joint.name, period_s); },
                                      request.parameters);
                                },
                            .configuration = configuration(request)};
  // In virtual time only a simulation moves.
  if (!options.virtual_time && !simulated && !request.yes) confirm(confirmation(request));
  runtime::stop_on_signals();
  return run_experiment(plan, options, robot, runtime::stop_requested);
}

int run_experiment(ExperimentRequest request) {
  const ExperimentOutcome outcome = perform_experiment(request);
  return report(request, outcome);
}

void leave_to_experiments(runtime::TomlTable& root) {
  for (const char* key : {"experiment", "parameters"}) root.ignore(key);
  ExperimentSettings().visit(
      [&root](const Parameter& parameter, const auto&) { root.ignore(parameter.key); });
}

}  // namespace youbot_bench
