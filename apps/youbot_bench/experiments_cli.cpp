#include "apps/youbot_bench/experiments_cli.h"

#include <spdlog/fmt/fmt.h>
#include <spdlog/spdlog.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <map>
#include <optional>
#include <set>
#include <sstream>
#include <stdexcept>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>
#include <variant>

#include "apps/common/build_info.h"
#include "apps/common/can_config.h"
#include "apps/common/drive_model_file.h"
#include "apps/common/ethercat_config.h"
#include "apps/common/exit_code.h"
#include "apps/common/finite_range.h"
#include "apps/common/hidden_effect.h"
#include "apps/common/plausibility_config.h"
#include "apps/common/quantity.h"
#include "apps/common/shared_tables.h"
#include "apps/common/stop_on_signals.h"
#include "apps/common/toml_reader.h"
#include "apps/youbot_bench/confirm.h"
#include "apps/youbot_bench/experiment_runner.h"
#include "apps/youbot_bench/progress.h"
#include "hal/axis_scale.h"
#include "hal/youbot_axes.h"
#include "identification/experiments/compensation.h"
#include "identification/experiments/dahl.h"
#include "identification/experiments/parameter.h"
#include "identification/experiments/reversals.h"
#include "identification/experiments/staircase.h"
#include "identification/experiments/steady_state.h"
#include "identification/experiments/stick_slip.h"
#include "identification/experiments/torque_ramp.h"
#include "identification/experiments/torque_wave.h"
#include "model/effects/dissipation.h"
#include "model/effects/resistance.h"
#include "model/friction/any_law.h"
#include "model/friction/law_compensator.h"
#include "model/friction/sliding_table.h"

namespace youbot_bench {

using identification::experiments::JointExperiment;
using identification::experiments::Parameter;

/// What all experiments have; the defaults of some depend on the experiment. Not in the anonymous namespace:
/// it is a member of ExperimentCommand, and g++ warns about that in a unity build.
struct CommonConfig {
  std::string robot = "loopback";
  std::string joints{};
  std::string model{};
  int hidden_effect = -1;
  double record_rate_Hz = 1000.0;
  double max_speed_rad_per_s = 12.0;
  double max_travel_rad = 0.0;
  std::string start_rad{};
  double filter_cutoff_rad_per_s = 125.0;
  double simulation_step_s = 5e-5;
  int noise_seed = 1;

  template <typename Visitor>
  void visit(Visitor&& v) {
    v(Parameter{"robot", "loopback, wire, ethercat:IFACE, can:IFACE"}, robot);
    v(Parameter{"joints", "such as wheel-2, or wheel-1,wheel-3, or arm-2 alone; none named: all wheels"},
      joints);
    v(Parameter{"model", "drive model file that simulated wheels follow; none: the measured curves"}, model);
    v(Parameter{"hidden_effect", "seed of an effect that simulated wheels have and nobody names; -1: none",
                -1, apps::HiddenEffect::kMostSeed},
      hidden_effect);
    v(Parameter{"record_rate_Hz", "rows a second, of the recording", 0.001, 1000}, record_rate_Hz);
    v(Parameter{"max_speed_rad_per_s",
                "beyond, it is stopped; joints of an arm have limits of their own, too", 0.01, 30},
      max_speed_rad_per_s);
    v(Parameter{"max_travel_rad", "in a measurement, likewise; 0: no limit", 0, 1e6}, max_travel_rad);
    v(Parameter{"start_rad", "where a joint of an arm is taken first; none: it begins where it stands"},
      start_rad);
    v(Parameter{"filter_cutoff_rad_per_s", "of the velocity", 1, 1000}, filter_cutoff_rad_per_s);
    v(Parameter{"simulation_step_s", "of the simulated drives", 1e-6, 2e-4}, simulation_step_s);
    v(Parameter{"noise_seed", "of the simulated sensors", 0, 2e9}, noise_seed);
  }
};

namespace {

std::optional<std::uint64_t> hidden_effect_of(const CommonConfig& config) {
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

/// @throws std::invalid_argument for a text that is no number.
std::optional<double> start_of(const CommonConfig& config) {
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
    return apps::toml_string(value);
  else
    return fmt::format("{}", value);
}

template <typename Value>
void read_toml(apps::TomlTable& table, const Parameter& parameter, Value& value) {
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

using identification::experiments::CompensationConfig;
using identification::experiments::DahlConfig;
using identification::experiments::MultisineConfig;
using identification::experiments::PreslidingConfig;
using identification::experiments::ReversalsConfig;
using identification::experiments::StaircaseConfig;
using identification::experiments::SteadyStateConfig;
using identification::experiments::StickSlipConfig;
using identification::experiments::TorqueRampConfig;

/// Files where they are found again, from wherever the experiment is resumed.
template <typename Config>
void make_paths_absolute(Config& /*config*/) {}

using Made = std::unique_ptr<JointExperiment>;
Made make(const SteadyStateConfig& config, const std::string& /*joint*/, double period_s) {
  return std::make_unique<identification::experiments::SteadyState>(config, period_s);
}
Made make(const TorqueRampConfig& config, const std::string& joint, double period_s) {
  return std::make_unique<identification::experiments::TorqueRamp>(config, encoder_step_rad(joint), period_s);
}
Made make(const DahlConfig& config, const std::string& /*joint*/, double /*period_s*/) {
  return std::make_unique<identification::experiments::Dahl>(config);
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

/// What the compensator believes.
model::friction::SlidingTable compensated_friction(const std::string& compensator, int wheel) {
  if (compensator.empty()) return model::friction::wheel_table(wheel);
  if (is_law(compensator)) return model::friction::law_table(model::friction::make_law(compensator));
  if (!std::filesystem::exists(compensator))
    throw std::invalid_argument("--compensator: " + compensator +
                                " is neither a file nor a law; identify --help lists the laws");
  const model::effects::DriveModel model = apps::read_drive_model(compensator);
  if (const std::string why = apps::driving_friction(model, model::effects::kUsualTopSpeed_rad_per_s);
      !why.empty())
    throw std::invalid_argument("--compensator: " + compensator + ": " + why);
  return model::effects::resistance_of(model).sliding;
}

/// Against the curve that was measured on this wheel. The observer blends from rest on.
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

}  // namespace

/// One subcommand: what the command line said, until it is run.
class ExperimentCommand {
 public:
  virtual ~ExperimentCommand() = default;
  ExperimentCommand(const ExperimentCommand&) = delete;
  ExperimentCommand& operator=(const ExperimentCommand&) = delete;

  bool chosen() const { return command_->parsed(); }
  int run();

 protected:
  ExperimentCommand(CLI::App& app, const std::string& name, std::string result, const std::string& about,
                    CommonConfig common)
      : name_(name), result_(std::move(result)), common_(std::move(common)) {
    command_ = app.add_subcommand(name, about);
    command_->footer(
        "The recording is in OUT/" + name + "/JOINT.csv" +
        (result_.empty() ? "" : ", the results in OUT/" + result_ + "/JOINT.csv") +
        ".\nSimulated robots have their wheels in the air and run in virtual time.\n"
        "What does not fit the range, torque or speed of an arm's joint is refused before it moves.\n"
        "Exit codes: 0 done or interrupted, 2 usage or configuration, 3 device, set-up or disk, "
        "4 stopped by a "
        "fault.");
    command_->add_option("--out", out_, "directory for the recordings, made if missing");
    command_->add_option("--resume", resume_, "go on with the experiment in this directory");
    command_->add_option("--config", config_file_,
                         "TOML file: the experiment.toml of a recording, or youbotd's, of which robot, "
                         "[ethercat] and [can] are read");
    command_->add_option("--kind", kind_,
                         "what is on the bus: base, base+arm, base+two-arms, arm; overrides the file (base)");
    CLI::Option* const real_time =
        command_->add_flag("--real-time", real_time_, "a simulated robot, too, in real time");
    command_
        ->add_flag("--virtual-time", virtual_time_, "a simulated robot on a bus, too: youbot-sim --lock-step")
        ->excludes(real_time);
    command_->add_flag("--allow-non-rt", allow_non_real_time_,
                       "go on when the system refuses real-time scheduling or memory locking");
    command_->add_flag("--yes", yes_,
                       "the wheels are off the ground, or the arm is free to move: do not ask");
    command_->add_flag("--quiet", quiet_, "print problems only");
    common_.visit([this](const Parameter& parameter, const auto& value) { add(parameter, value); });
  }

  /// What is given is kept until the file was read, over which it stands.
  template <typename Value>
  void add(const Parameter& parameter, const Value& value) {
    const std::string option = apps::option_name(parameter.key);
    const std::string unit = apps::quantity_of(parameter.key).unit;
    const std::string help = parameter.help + (unit.empty() ? "" : ", " + unit);
    CLI::Option* added = nullptr;
    if constexpr (std::is_same_v<Value, std::string>) {
      added = command_->add_option_function<std::vector<std::string>>(
          option,
          [this, key = std::string(parameter.key)](const std::vector<std::string>& values) {
            given_[key] = fmt::format("{}", fmt::join(values, ","));
          },
          help);
      if (option != "--joint") added->expected(1);  // may be given several times
    } else {
      added = command_->add_option_function<Value>(
          option, [this, key = std::string(parameter.key)](const Value& given) { given_[key] = given; },
          help);
      if constexpr (!std::is_same_v<Value, bool>)
        added->check(apps::finite_range(parameter.min, parameter.max));
    }
    if (const std::string text = fmt::format("{}", value); !text.empty()) added->default_str(text);
  }

  /// Takes what the command line gave over what was there.
  template <typename Config>
  void take_given(Config& config) const {
    config.visit([this](const Parameter& parameter, auto& value) {
      const auto given = given_.find(parameter.key);
      if (given != given_.end()) value = std::get<std::remove_cvref_t<decltype(value)>>(given->second);
    });
  }
  template <typename Config>
  static void read(Config& config, apps::TomlTable table) {
    config.visit([&table](const Parameter& parameter, auto& value) { read_toml(table, parameter, value); });
  }
  template <typename Config>
  static std::string written(Config config) {
    std::string text;
    config.visit([&text](const Parameter& parameter, const auto& value) {
      text += fmt::format("{} = {}  # {}\n", parameter.key, toml_text(value), parameter.help);
    });
    return text;
  }

  virtual void take_given_parameters() = 0;
  virtual void read_parameters(apps::TomlTable table) = 0;
  virtual std::string written_parameters() const = 0;
  virtual Made make_experiment(const std::string& joint, double period_s) const = 0;

 private:
  void load(const std::filesystem::path& file);
  Confirmation confirmation() const;
  int report(const ExperimentOutcome& outcome, const std::filesystem::path& directory) const;

  std::string name_;
  std::string result_;
  CommonConfig common_;
  CLI::App* command_ = nullptr;
  std::map<std::string, std::variant<double, int, bool, std::string>> given_;
  std::string out_;
  std::string resume_;
  std::string config_file_;
  std::string kind_;
  hal::EthercatOptions ethercat_{.kind = hal::EthercatOptions::Kind::kBase};
  hal::CanOptions can_;
  control::ChecksOff checks_off_;
  bool real_time_ = false;
  bool virtual_time_ = false;
  bool allow_non_real_time_ = false;
  bool yes_ = false;
  bool quiet_ = false;
};

namespace {

template <typename Config>
class CommandOf final : public ExperimentCommand {
 public:
  CommandOf(CLI::App& app, const std::string& name, std::string result, const std::string& about,
            CommonConfig common = {})
      : ExperimentCommand(app, name, std::move(result), about, std::move(common)) {
    config_.visit([this](const Parameter& parameter, const auto& value) { this->add(parameter, value); });
  }

 private:
  void take_given_parameters() override {
    take_given(config_);
    make_paths_absolute(config_);
  }
  void read_parameters(apps::TomlTable table) override { read(config_, table); }
  std::string written_parameters() const override { return written(config_); }
  Made make_experiment(const std::string& joint, double period_s) const override {
    return make(config_, joint, period_s);
  }
  Config config_;
};

}  // namespace

void ExperimentCommand::load(const std::filesystem::path& file) {
  apps::TomlFile toml = apps::TomlFile::parse(file);
  apps::TomlTable root = toml.root();
  std::string experiment = name_;
  root.text("experiment", experiment);
  if (experiment != name_) root.refuse("experiment", "is '" + experiment + "', not '" + name_ + "'");
  read(common_, root);
  read_parameters(root.table("parameters"));
  apps::TomlTable ethercat = root.table("ethercat");
  apps::read_ethercat(ethercat, ExperimentOptions{}.period, ethercat_);
  apps::TomlTable can = root.table("can");
  apps::read_can(can, can_);
  apps::read_plausibility(root.table("plausibility"), checks_off_);
  apps::leave_to_others(root, {"robot", "ethercat", "can", "plausibility"});
  toml.finish();
}

int ExperimentCommand::run() {
  const bool resume = !resume_.empty();
  const std::filesystem::path directory = resume ? resume_ : out_;
  if (resume && (!out_.empty() || !config_file_.empty() || !kind_.empty() || !given_.empty()))
    throw std::invalid_argument("--resume: the configuration is that of the recording; give no other");
  if (directory.empty()) throw std::invalid_argument("--out DIR is missing: where to record");
  if (resume)
    load(directory / name_ / "experiment.toml");
  else if (!config_file_.empty())
    load(config_file_);
  take_given(common_);
  take_given_parameters();
  common_ = identification::experiments::checked(common_);
  if (!kind_.empty()) ethercat_.kind = apps::ethercat_kind(kind_);

  const bool simulated = apps::is_simulated(common_.robot);
  if (!common_.model.empty() && !simulated)
    throw std::invalid_argument("--model: only a simulated robot follows a model, not " + common_.robot);
  if (common_.hidden_effect >= 0 && !simulated)
    throw std::invalid_argument("--hidden-effect: only a simulated robot has one to hide, not " +
                                common_.robot);
  ExperimentOptions options{.joints = split(common_.joints),
                            .directory = directory,
                            .resume = resume,
                            .virtual_time = virtual_time_ || (simulated && !real_time_),
                            .quiet = quiet_,
                            .allow_non_real_time = allow_non_real_time_,
                            .record_rate_Hz = common_.record_rate_Hz,
                            .max_speed_rad_per_s = common_.max_speed_rad_per_s,
                            .max_travel_rad = common_.max_travel_rad,
                            .start_rad = start_of(common_),
                            .filter_cutoff_rad_per_s = common_.filter_cutoff_rad_per_s,
                            .checks_off = checks_off_};
  if (ethercat_.home_arms) options.enable_timeout = apps::kHomingTimeout;
  apps::RobotOptions robot;
  robot.name = common_.robot;
  robot.ethercat = ethercat_;
  robot.can = can_;
  robot.simulation.on_ground = false;
  robot.simulation.step = std::chrono::nanoseconds(std::llround(common_.simulation_step_s * 1e9));
  robot.simulation.noise_seed = static_cast<std::uint64_t>(common_.noise_seed);
  // Where it is found again, from wherever the experiment is resumed.
  if (!common_.model.empty()) common_.model = std::filesystem::absolute(common_.model).string();
  robot.simulation.model = apps::simulated_wheel_model(common_.model, hidden_effect_of(common_));
  const ExperimentPlan plan{
      .name = name_,
      .result = result_,
      .make = [this](const hal::JointInfo& joint,
                     double period_s) { return make_experiment(joint.name, period_s); },
      .configuration = fmt::format("# youbot-bench {} --config THIS_FILE --out DIR makes it again\n"
                                   "# software: {}\n"
                                   "experiment = \"{}\"\n{}\n[parameters]\n{}\n{}\n{}\n{}",
                                   name_, apps::build_version(), name_, written(common_),
                                   written_parameters(), apps::ethercat_text(ethercat_), apps::can_text(can_),
                                   apps::plausibility_text(checks_off_))};
  // In virtual time nothing but a simulation moves.
  if (!options.virtual_time && !simulated && !yes_) confirm(confirmation());
  apps::stop_on_signals();
  return report(run_experiment(plan, options, robot, apps::stop_requested), directory);
}

Confirmation ExperimentCommand::confirmation() const {
  const bool arm = common_.joints.find("arm") != std::string::npos;
  if (arm)
    return {.robot = common_.robot,
            .what = ethercat_.home_arms ? common_.joints + " will turn, and the arm goes to its end stops"
                                        : common_.joints + " will turn",
            .question = "Is the arm free to move, with no person within its reach?",
            .answer = "free to move",
            .otherwise = "Clear the arm's reach and add --yes"};
  return {.robot = common_.robot,
          .what = ethercat_.home_arms ? "the joints will turn, and the arm goes to its end stops"
                                      : "the joints will turn",
          .question = "Are the wheels off the ground?",
          .answer = "off the ground",
          .otherwise = "Lift the wheels off the ground and add --yes"};
}

int ExperimentCommand::report(const ExperimentOutcome& outcome,
                              const std::filesystem::path& directory) const {
  for (const std::string& problem : outcome.not_real_time) spdlog::warn("not real-time: {}", problem);
  if (!quiet_) {
    std::printf("%s: %d of %d measurements, %s of robot time in %s\n", name_.c_str(), outcome.finished,
                outcome.planned,
                duration_text(std::chrono::duration<double>(outcome.robot_time).count()).c_str(),
                duration_text(std::chrono::duration<double>(outcome.wall_time).count()).c_str());
    std::printf("recorded in %s\n", (directory / name_).c_str());
    if (!result_.empty()) std::printf("results in %s\n", (directory / result_).c_str());
    std::printf("report: %s\n", (directory / "report.html").c_str());
    if (outcome.overruns > 0)
      std::printf("%llu cycles were late\n", static_cast<unsigned long long>(outcome.overruns));
  }
  for (const std::string& problem : outcome.recording_problems) spdlog::error("recording: {}", problem);
  for (const std::string& reason : outcome.not_measured) spdlog::warn("not measured: {}", reason);
  if (!outcome.fault.empty()) {
    spdlog::error("stopped by a fault at {}", outcome.fault);
    spdlog::error("what was recorded until then is in {}", (directory / name_).string());
    for (const std::string& finding : outcome.robot_report) spdlog::error("robot: {}", finding);
    if (!outcome.frames.empty())
      spdlog::error("the last frames before it are in {}", outcome.frames.string());
  } else if (!quiet_) {
    for (const std::string& finding : outcome.robot_report) std::printf("robot: %s\n", finding.c_str());
  }
  if (outcome.finished < outcome.planned)
    spdlog::warn("not finished; go on with: youbot-bench {} --resume {}", name_, directory.string());
  if (!outcome.fault.empty()) return apps::kExitFault;
  return outcome.recording_problems.empty() ? apps::kExitOk : apps::kExitSetup;
}

ExperimentCommands::ExperimentCommands(CLI::App& app) {
  commands_.push_back(std::make_unique<CommandOf<SteadyStateConfig>>(
      app, "steady-state", "steady-state-map",
      "friction against velocity: constant velocities, mean torque with its confidence interval",
      CommonConfig{.record_rate_Hz = 10}));
  commands_.push_back(std::make_unique<CommandOf<TorqueRampConfig>>(
      app, "torque-ramp", "torque-ramp-result",
      "slow torque ramps until the first encoder step, and break-away",
      CommonConfig{.max_speed_rad_per_s = 5, .max_travel_rad = 3}));
  commands_.push_back(std::make_unique<CommandOf<DahlConfig>>(
      app, "dahl", "dahl-result", "sine of torque below stiction; slope of the torque-displacement loop",
      CommonConfig{.max_speed_rad_per_s = 2, .max_travel_rad = 0.5}));
  commands_.push_back(std::make_unique<CommandOf<PreslidingConfig>>(
      app, "presliding", "presliding-result", "multisine or sine of torque below stiction",
      CommonConfig{.max_speed_rad_per_s = 2, .max_travel_rad = 0.5}));
  commands_.push_back(std::make_unique<CommandOf<StickSlipConfig>>(
      app, "stick-slip", "stick-slip-result", "a soft spring in software drags the joint slowly",
      CommonConfig{.max_speed_rad_per_s = 6, .max_travel_rad = 20}));
  commands_.push_back(std::make_unique<CommandOf<CompensationConfig>>(
      app, "compensation", "compensation-result",
      "swings on a spring after a push, without and with friction compensation",
      CommonConfig{.max_speed_rad_per_s = 10, .max_travel_rad = 6.3}));
  commands_.push_back(std::make_unique<CommandOf<StaircaseConfig>>(
      app, "staircase", "", "steps of torque or velocity in both directions"));
  commands_.push_back(std::make_unique<CommandOf<ReversalsConfig>>(
      app, "reversals", "", "velocity to and fro in triangles that become smaller"));
  commands_.push_back(std::make_unique<CommandOf<MultisineConfig>>(
      app, "multisine", "multisine-result", "multisine of torque, low peaks by Schroeder's phases"));
}

ExperimentCommands::~ExperimentCommands() = default;

bool ExperimentCommands::chosen() const {
  for (const auto& command : commands_)
    if (command->chosen()) return true;
  return false;
}

int ExperimentCommands::run() {
  for (const auto& command : commands_)
    if (command->chosen()) return command->run();
  return apps::kExitUsage;
}

void leave_to_experiments(apps::TomlTable& root) {
  for (const char* key : {"experiment", "parameters"}) root.ignore(key);
  CommonConfig().visit([&root](const Parameter& parameter, const auto&) { root.ignore(parameter.key); });
}

}  // namespace youbot_bench
