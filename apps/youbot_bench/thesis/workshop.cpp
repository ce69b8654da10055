#include "apps/youbot_bench/thesis/workshop.h"

#include <stdexcept>
#include <utility>
#include <variant>
#include <vector>

#include "apps/youbot_bench/experiment_runner.h"
#include "apps/youbot_bench/thesis/models.h"
#include "runtime/configuration/drive_model_file.h"
#include "runtime/configuration/whole_file.h"
#include "runtime/program/stop_on_signals.h"
#include "runtime/recording/output_directory.h"

namespace youbot_bench::thesis {
namespace {

namespace effects = model::effects;

std::filesystem::path model_file(const std::filesystem::path& folder, std::size_t wheel) {
  return folder / ("wheel-" + std::to_string(wheel + 1) + ".toml");
}

}  // namespace

Workshop::Workshop(std::filesystem::path directory, std::function<void(const std::string&)> show)
    : directory_(std::move(directory)), show_(std::move(show)), thesis_robot_{.name = "thesis-robot"} {
  const std::filesystem::path folder = directory_ / thesis_robot_.name;
  runtime::make_output_directory(folder);
  const std::array<std::string_view, 4> texts{kWheel1, kWheel2, kWheel3, kWheel4};
  for (std::size_t i = 0; i < texts.size(); ++i) {
    runtime::write_whole_file(model_file(folder, i), texts[i]);
    thesis_robot_.models[i] = runtime::read_drive_model(model_file(folder, i));
  }
}

Wheels Workshop::robot_without_offset() const {
  Wheels wheels = thesis_robot_;
  wheels.name = "without-offset";
  for (effects::DriveModel& model : wheels.models)
    std::erase_if(model.effects, [](const effects::AnyEffect& effect) {
      return std::holds_alternative<effects::TorqueDeadband>(effect) ||
             std::holds_alternative<effects::UnsignedCurrent>(effect);
    });
  return wheels;
}

Wheels Workshop::robot_with_law(const std::string& law) const {
  Wheels wheels = robot_without_offset();
  wheels.name = law;
  const model::friction::AnyLaw friction = model::friction::make_law(law);
  const bool has_memory = model::friction::law_description(law).has_memory;
  for (effects::DriveModel& model : wheels.models)
    for (auto effect = model.effects.begin(); effect != model.effects.end();) {
      if (std::holds_alternative<effects::FrictionLaw>(*effect)) *effect = effects::FrictionLaw(friction);
      // A law with memory has its own springs.
      const bool spring = std::holds_alternative<effects::Presliding>(*effect);
      effect = spring && has_memory ? model.effects.erase(effect) : effect + 1;
    }
  return wheels;
}

void Workshop::go_on() {
  if (runtime::stop_requested) throw Stopped();
}

void Workshop::begin(const std::string& stage) const {
  go_on();
  show_(stage);
}

MeasuredExperiment Workshop::measure(const std::string& figure, const Wheels& wheels,
                                     const ExperimentParameters& parameters, const std::string& joints,
                                     bool with_rows) const {
  begin(figure);
  ExperimentRequest request = experiment_request(parameters);
  const std::filesystem::path robot = directory_ / wheels.name;
  runtime::make_output_directory(robot);
  for (std::size_t i = 0; i < wheels.models.size(); ++i) {
    const std::filesystem::path file = model_file(robot, i);
    if (!std::filesystem::exists(file))
      runtime::write_whole_file(file, runtime::drive_model_text(wheels.models[i]));
    request.settings.model += (i == 0 ? "" : ",") + file.string();
  }
  request.settings.joints = joints;
  request.directory = directory_ / figure;
  request.quiet = true;
  const std::string name = request.name;
  const std::string result = request.result;
  const ExperimentOutcome outcome = perform_experiment(request);
  if (outcome.interrupted) throw Stopped();
  if (!outcome.fault.empty())
    throw std::runtime_error(figure + ": " + name + " was stopped by a fault at " + outcome.fault);
  if (!outcome.recording_problems.empty())
    throw std::runtime_error(figure + ": " + outcome.recording_problems.front());
  return read_experiment(directory_ / figure, name, result, with_rows);
}

}  // namespace youbot_bench::thesis
