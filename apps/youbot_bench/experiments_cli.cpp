#include "apps/youbot_bench/experiments_cli.h"

#include <spdlog/fmt/fmt.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <map>
#include <memory>
#include <stdexcept>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>
#include <variant>

#include "apps/youbot_bench/experiment_request.h"
#include "runtime/configuration/ethercat_config.h"
#include "runtime/configuration/finite_range.h"
#include "runtime/configuration/quantity.h"

namespace youbot_bench {

using identification::experiments::Parameter;

/// One subcommand: stores the command line's values until it runs.
class ExperimentCommand {
 public:
  ExperimentCommand(CLI::App& app, ExperimentRequest request);
  ExperimentCommand(const ExperimentCommand&) = delete;
  ExperimentCommand& operator=(const ExperimentCommand&) = delete;

  CLI::App* app() const { return command_; }
  int run();

 private:
  template <typename Value>
  void add(const Parameter& parameter, const Value& value);
  template <typename Config>
  void take_given(Config& config) const;

  ExperimentRequest request_;
  CLI::App* command_ = nullptr;
  std::map<std::string, std::variant<double, int, bool, std::string>> given_;
  std::string out_;
  std::string resume_;
  std::string config_file_;
  std::string kind_;
};

ExperimentCommand::ExperimentCommand(CLI::App& app, ExperimentRequest request)
    : request_(std::move(request)), command_(app.add_subcommand(request_.name, request_.about)) {
  const std::string name = request_.name;
  const std::string result = request_.result;
  command_->footer(
      "The recording is in OUT/" + name + "/JOINT.csv" +
      (result.empty() ? "" : ", the results in OUT/" + result + "/JOINT.csv") +
      ".\nSimulated robots have their wheels in the air and run in virtual time.\nAn experiment beyond the "
      "range, torque or speed of an arm joint is rejected before anything moves.\nExit codes: 0 done, 130 "
      "interrupted, 2 usage or configuration, 3 device, set-up or disk, 4 stopped by a fault.");
  command_->add_option("--out", out_, "directory for the recordings, made if missing");
  command_->add_option("--resume", resume_, "continue the experiment in this directory");
  command_->add_option("--config", config_file_,
                       "TOML file: the experiment.toml of a recording, or youbotd's, of which robot, "
                       "[ethercat] and [can] are read");
  command_->add_option(
      "--kind", kind_,
      "kind of robot on the bus: base, base+arm, base+two-arms, arm; overrides the file (base)");
  CLI::Option* const real_time =
      command_->add_flag("--real-time", request_.real_time, "run a simulated robot in real time");
  command_
      ->add_flag("--virtual-time", request_.virtual_time,
                 "virtual time for a simulated robot on a bus: youbot-sim --lock-step")
      ->excludes(real_time);
  command_->add_flag("--allow-non-rt", request_.allow_non_real_time,
                     "continue when the system refuses real-time scheduling or memory locking");
  command_->add_flag("--yes", request_.yes,
                     "the wheels are off the ground, or the arm is free to move: do not ask");
  command_->add_flag("--quiet", request_.quiet, "print problems only");
  const auto add_one = [this](const Parameter& parameter, const auto& value) { add(parameter, value); };
  request_.settings.visit(add_one);
  std::visit([&](auto& config) { config.visit(add_one); }, request_.parameters);
}

/// Command-line values are kept until the file has been read; they override it.
template <typename Value>
void ExperimentCommand::add(const Parameter& parameter, const Value& value) {
  const std::string option = runtime::option_name(parameter.key);
  const std::string unit = runtime::quantity_of(parameter.key).unit;
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
        option, [this, key = std::string(parameter.key)](const Value& given) { given_[key] = given; }, help);
    if constexpr (!std::is_same_v<Value, bool>)
      added->check(runtime::finite_range(parameter.min, parameter.max));
  }
  if (const std::string text = fmt::format("{}", value); !text.empty()) added->default_str(text);
}

/// Applies the command line's values.
template <typename Config>
void ExperimentCommand::take_given(Config& config) const {
  config.visit([this](const Parameter& parameter, auto& value) {
    const auto given = given_.find(parameter.key);
    if (given != given_.end()) value = std::get<std::remove_cvref_t<decltype(value)>>(given->second);
  });
}

int ExperimentCommand::run() {
  request_.resume = !resume_.empty();
  request_.directory = request_.resume ? resume_ : out_;
  if (request_.resume && (!out_.empty() || !config_file_.empty() || !kind_.empty() || !given_.empty()))
    throw std::invalid_argument("--resume: the configuration is that of the recording; give no other");
  if (request_.directory.empty()) throw std::invalid_argument("--out DIR is missing: where to record");
  if (request_.resume)
    read_experiment(request_.directory / request_.name / "experiment.toml", request_);
  else if (!config_file_.empty())
    read_experiment(config_file_, request_);
  take_given(request_.settings);
  std::visit([this](auto& config) { take_given(config); }, request_.parameters);
  if (!kind_.empty()) request_.ethercat.kind = runtime::ethercat_kind(kind_);
  return run_experiment(request_);
}

std::vector<Subcommand> add_experiments(CLI::App& app) {
  std::vector<Subcommand> all;
  for (ExperimentRequest& request : experiment_requests()) {
    const auto command = std::make_shared<ExperimentCommand>(app, std::move(request));
    all.push_back({command->app(), [command] { return command->run(); }});
  }
  return all;
}

}  // namespace youbot_bench
