#include "apps/youbot_bench/improve.h"

#include <CLI/CLI.hpp>

#include <array>
#include <atomic>
#include <chrono>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <deque>
#include <future>
#include <map>
#include <memory>
#include <stdexcept>
#include <string>
#include <string_view>
#include <utility>

#include "analysis/explain.h"
#include "apps/youbot_bench/confirm.h"
#include "apps/youbot_bench/experiment_request.h"
#include "apps/youbot_bench/improve_report.h"
#include "hal/setup_error.h"
#include "operation/config.h"
#include "operation/demo_config.h"
#include "runtime/configuration/drive_model_file.h"
#include "runtime/configuration/finite_range.h"
#include "runtime/configuration/hidden_effect.h"
#include "runtime/configuration/regular_file.h"
#include "runtime/configuration/toml_reader.h"
#include "runtime/configuration/whole_file.h"
#include "runtime/log.h"
#include "runtime/open_robot.h"
#include "runtime/program/exit_code.h"
#include "runtime/program/progress_line.h"
#include "runtime/program/stop_on_signals.h"
#include "runtime/recording/output_directory.h"

namespace youbot_bench {
namespace {

namespace fs = std::filesystem;

/// Shares of the whole work.
constexpr double kRecorded = 0.2;
constexpr double kExplained = 0.9;

/// The measurements of a typical lab, with sufficient information: constant speeds in both directions,
/// broadband, slow through breakaway, below breakaway, and reversals from fast to slow.
std::vector<ExperimentRequest> experiments() {
  namespace of = identification::experiments;
  return {experiment_request(
              of::StaircaseConfig{.quantity = "velocity", .step = 0.8, .highest = 8, .hold_s = 0.7}),
          experiment_request(of::MultisineConfig{.highest_Hz = 1.5, .periods = 3}),
          experiment_request(of::TorqueRampConfig{.rest_s = 1, .rate_Nm_per_s = 0.03, .repeats = 3}),
          experiment_request(of::PreslidingConfig{.periods = 1}), experiment_request(of::ReversalsConfig{})};
}

std::string wheel_name(int wheel) { return "wheel-" + std::to_string(wheel); }

std::vector<int> explained_wheels(const ImproveOptions& options) {
  if (options.wheel != 0) return {options.wheel};
  return {1, 2, 3, 4};
}

void record(ExperimentRequest experiment, const ImproveOptions& options) {
  if (!options.config.empty()) read_experiment(options.config, experiment);
  experiment.settings.robot = options.robot;
  if (options.hidden_effect) experiment.settings.hidden_effect = static_cast<int>(*options.hidden_effect);
  experiment.directory = options.out / "recordings";
  experiment.virtual_time = options.virtual_time;
  experiment.allow_non_real_time = options.allow_non_real_time;
  experiment.yes = true;  // improve() has already asked
  experiment.quiet = true;
  const std::string name = experiment.name;
  const int code = run_experiment(std::move(experiment));
  if (code != runtime::kExitOk && code != runtime::kExitInterrupted)
    throw hal::SetupError("youbot-bench", "record the experiment " + name, "see above");
}

/// In virtual time only a simulation moves.
bool moves_a_machine(const ImproveOptions& options) {
  return !runtime::is_simulated(options.robot) && !options.virtual_time;
}

bool came_to_its_end(const Run& run) { return run.summary.stop_reason.empty() && !run.summary.cut_short; }

/// Thrown through a search, which cannot be stopped otherwise.
struct Stopped {};

analysis::GapOptions prepare_search(int wheel, const fs::path& out) {
  const fs::path directory = out / wheel_name(wheel);
  runtime::make_output_directory(directory);
  model::effects::DriveModel model = runtime::known_wheel_model();
  model.name = wheel_name(wheel);
  runtime::write_whole_file(directory / "base.toml", runtime::drive_model_text(model));
  analysis::GapOptions search{.inputs = {.model = directory / "base.toml"}, .out = directory};
  for (const ExperimentRequest& experiment : experiments())
    search.inputs.data.push_back(out / "recordings" / experiment.name / (wheel_name(wheel) + ".csv"));
  return search;
}

/// All wheels at once. @throws Stopped if the program is asked to end.
std::vector<analysis::Findings> explain(const ImproveOptions& options, runtime::ProgressLine& progress) {
  struct Search {
    analysis::GapOptions options;
    analysis::Inputs inputs;
    std::atomic<double> done{0};
    std::future<analysis::Findings> findings;  // last: waits for its thread, which uses the others
  };
  std::deque<Search> searches;
  for (const int wheel : explained_wheels(options)) {
    Search& search = searches.emplace_back();
    search.options = prepare_search(wheel, options.out);
    search.inputs = analysis::read_inputs(search.options.inputs);
    for (const std::string& warning : search.inputs.warnings) spdlog::warn("{}", warning);
  }
  for (Search& search : searches)
    search.findings = std::async(std::launch::async, [&search] {
      return analysis::write_findings(std::move(search.inputs), search.options,
                                      [&search](std::string_view, double done) {
                                        if (runtime::stop_requested) throw Stopped();
                                        search.done = done;
                                      });
    });
  std::vector<analysis::Findings> findings;
  for (Search& search : searches) {
    while (search.findings.wait_for(std::chrono::milliseconds(100)) != std::future_status::ready) {
      double done = 0;
      for (const Search& each : searches) done += each.done / static_cast<double>(searches.size());
      progress.show("searching for what the model lacks", std::lerp(kRecorded, kExplained, done));
    }
    findings.push_back(search.findings.get());
  }
  return findings;
}

/// A configuration with an additional line in one of its tables.
std::string with_line(std::string config, const std::string& table, const std::string& line) {
  const std::size_t header = config.find("\n[" + table + "]");
  if (header == std::string::npos) return config + "\n[" + table + "]\n" + line + "\n";
  return config.insert(config.find('\n', header + 1) + 1, line + "\n");
}

control::PlanarPose pose_of(const std::array<double, 3>& values) { return {values[0], values[1], values[2]}; }

Run driven(const operation::Config& config, const fs::path& file, const ImproveOptions& options) {
  static constexpr std::chrono::milliseconds kBetweenPoints{50};
  static constexpr std::size_t kMaxPoints = 50'000;  // allocated in advance: a drive may be in real time
  Run run;
  run.time_s.reserve(kMaxPoints);
  run.X_WB.reserve(kMaxPoints);
  run.reference_X_WB.reserve(kMaxPoints);
  operation::SessionOptions session;
  session.config_file = file;
  session.virtual_time = options.virtual_time || runtime::is_simulated(options.robot);
  session.allow_non_real_time = options.allow_non_real_time;
  session.after_cycle = [&run,
                         next = std::chrono::nanoseconds{}](const operation::CycleRecord& record) mutable {
    if (record.time < next || !std::isfinite(record.reference_W[0]) || run.time_s.size() == kMaxPoints)
      return;
    next = record.time + kBetweenPoints;
    run.time_s.push_back(std::chrono::duration<double>(record.time).count());
    run.X_WB.push_back(pose_of(std::isfinite(record.truth_W[0]) ? record.truth_W : record.odometry_W));
    run.reference_X_WB.push_back(pose_of(record.reference_W));
  };
  run.summary = operation::run_session(config, session, runtime::stop_requested);
  return run;
}

std::string config_text(const fs::path& path) {
  try {
    return runtime::read_regular_file(path, runtime::kMaxToml_bytes);
  } catch (const std::runtime_error& error) {
    throw std::invalid_argument("--config: " + path.string() + ": " + error.what());
  }
}

/// A person is next to the robot, and has carried it back.
void confirm_it_may_drive(const ImproveOptions& options, const std::string& name) {
  if (!moves_a_machine(options) || options.yes) return;
  confirm({.robot = options.robot,
           .what = "THE BASE WILL DRIVE its path by itself, with the " + name + " in the compensator",
           .question = "Is it on the ground where it may, the emergency stop in your hand?",
           .answer = "on the ground",
           .otherwise = "Set it down where it may drive four times in a row and add --stage drive --yes"});
}

/// The driven configuration without the models.
std::string configuration(const ImproveOptions& options) {
  return options.config.empty() ? std::string(operation::kDemoConfig) : config_text(options.config);
}

/// Writes the configuration next to the models and drives it. Ends early on request and on a fault.
Drive drive(const ImproveOptions& options, const std::string& name, const std::string& model_file,
            const std::string& simulated_wheels) {
  std::string models;
  for (int wheel = 1; wheel <= 4; ++wheel)
    models += (wheel > 1 ? ", \"" : "\"") + wheel_name(options.wheel != 0 ? options.wheel : wheel) + "/" +
              model_file + "\"";
  std::string text = with_line(configuration(options), "compensation", "models = [" + models + "]");
  if (!simulated_wheels.empty()) text = with_line(std::move(text), "simulation", simulated_wheels);
  const fs::path file = options.out / ("youbotd-" + name + ".toml");
  runtime::write_whole_file(file, text);

  operation::Config config = operation::load_config(file);
  config.robot.name = options.robot;
  config.robot.arm.reset();  // [simulation] robot_file: only the base drives
  if (!moves_a_machine(options)) config.cycle.allow_any_following_error();
  Drive result;
  confirm_it_may_drive(options, name + " model");
  result.demo = driven(config, file, options);
  if (!came_to_its_end(result.demo)) return result;
  for (control::PlanarVector& displacement_B : config.path.displacements_B)
    displacement_B = displacement_B.cwiseProduct(control::PlanarVector(1, -1, -1));
  confirm_it_may_drive(options, name + " model, mirrored");
  result.mirrored = driven(config, file, options);
  return result;
}

/// The drives use a copy in the output directory, with models of the wheels of their own.
/// @throws runtime::ConfigError, std::invalid_argument if that copy would not be read.
void check_configuration(const fs::path& file) {
  const operation::Config config = operation::load_config(file);
  if (config.cycle.controller.wheels)
    throw std::invalid_argument("--config: " + file.string() +
                                ": remove 'models' from [compensation]: the models found replace them");
  for (const runtime::RecordingFile::Attachment& attached : config.models)
    if (!fs::path(attached.name).is_absolute())
      throw std::invalid_argument("--config: " + file.string() + ": give the absolute path of '" +
                                  attached.name + "': the drives use a copy of the file in --out");
}

void check(const ImproveOptions& options) {
  using Stage = ImproveOptions::Stage;
  if (runtime::is_simulated(options.robot)) {
    if (options.robot != "loopback" || !options.config.empty() || options.stage != Stage::kBoth)
      throw std::invalid_argument(
          "--robot: ethercat:IFACE alone takes --config and --stage; without it the simulated robot in this "
          "program is measured and driven");
    if (!options.hidden_effect)
      throw std::invalid_argument("--hidden-effect SEED is missing, or a robot: --robot ethercat:IFACE");
    return;
  }
  runtime::check_virtual_time(options.robot);
  if (!options.config.empty()) check_configuration(options.config);
  if (options.hidden_effect)
    throw std::invalid_argument(
        "--hidden-effect: not for a robot on a bus; start youbot-sim --hidden-effect SEED there");
  if (moves_a_machine(options) && options.yes && options.stage == Stage::kBoth)
    throw std::invalid_argument(
        "--yes: no one would set the robot down between measuring and driving; first --stage measure --yes, "
        "then --stage drive --yes");
}

/// Checks that the measurement has left everything needed for driving, and that nothing has been driven yet.
void check_measured(const ImproveOptions& options) {
  for (const int wheel : explained_wheels(options))
    for (const char* const file : {"base.toml", "model.toml"})
      if (!fs::exists(options.out / wheel_name(wheel) / file))
        throw std::invalid_argument("--stage drive: there is no " +
                                    (options.out / wheel_name(wheel) / file).string() +
                                    "; --stage measure writes it");
  if (fs::exists(options.out / "report.html"))
    throw std::invalid_argument("--stage drive: " + options.out.string() +
                                " holds the report of earlier drives, which is not replaced");
}

/// False if it was asked to stop.
bool measure(const ImproveOptions& options, runtime::ProgressLine& progress, Improvement& improvement) {
  runtime::make_output_directory(options.out);
  runtime::require_empty(options.out);
  if (moves_a_machine(options) && !options.yes)
    confirm({.robot = options.robot,
             .what = "ALL WHEELS WILL TURN, for some minutes",
             .question = "Are they off the ground, the emergency stop in your hand?",
             .answer = "off the ground",
             .otherwise = "Lift the wheels off the ground and add --stage measure --yes"});
  double done = 0;
  const std::vector<ExperimentRequest> all = experiments();
  for (const ExperimentRequest& experiment : all) {
    progress.show(std::string("recording ") + experiment.name, done);
    record(experiment, options);
    if (runtime::stop_requested) return false;
    done += kRecorded / static_cast<double>(all.size());
  }
  try {
    improvement.wheels = explain(options, progress);
  } catch (const Stopped&) {
    return false;
  }
  return true;
}

void drive_both(const ImproveOptions& options, runtime::ProgressLine& progress, Improvement& improvement) {
  const auto came_to_their_end = [](const Drive& drive) {
    return came_to_its_end(drive.demo) && came_to_its_end(drive.mirrored);
  };
  progress.show("driving with the known model", kExplained);
  std::string simulated_wheels;
  if (options.hidden_effect) {
    const std::string known = wheel_name(explained_wheels(options).front()) + "/base.toml";
    improvement.nothing_hidden = drive(options, "nothing-hidden", "base.toml", "model = \"" + known + "\"");
    if (!came_to_their_end(*improvement.nothing_hidden)) return;
    simulated_wheels = "hidden_effect = " + std::to_string(*options.hidden_effect);
  }
  improvement.base = drive(options, "base", "base.toml", simulated_wheels);
  if (!came_to_their_end(improvement.base)) return;
  progress.show("driving with the improved model", (1 + kExplained) / 2);
  improvement.improved = drive(options, "improved", "model.toml", simulated_wheels);
}

}  // namespace

Improvement run_chain(const ImproveOptions& options) {
  using Stage = ImproveOptions::Stage;
  check(options);
  runtime::ProgressLine progress("youbot-bench improve", options.quiet);
  Improvement improvement;
  if (options.stage == Stage::kDrive) check_measured(options);
  if (options.stage != Stage::kDrive && !measure(options, progress, improvement)) return improvement;
  if (options.stage != Stage::kMeasure) drive_both(options, progress, improvement);
  if (runtime::stop_requested) return improvement;
  progress.show("done", 1);
  progress.finish();
  return improvement;
}

int improve(const ImproveOptions& options) {
  runtime::stop_on_signals();
  const Improvement improvement = run_chain(options);
  for (const Drive* drive : {improvement.nothing_hidden ? &*improvement.nothing_hidden : nullptr,
                             &improvement.base, &improvement.improved}) {
    if (drive == nullptr) continue;
    for (const Run* run : {&drive->demo, &drive->mirrored}) {
      if (run->summary.stop_reason.empty()) continue;
      spdlog::error("a drive was stopped by a fault at {}", run->summary.stop_reason);
      return runtime::kExitFault;
    }
  }
  if (runtime::stop_requested) {
    spdlog::info("stopped on request, nothing to compare");
    return runtime::kExitInterrupted;
  }
  std::string text = improvement_text(improvement);
  if (options.stage == ImproveOptions::Stage::kMeasure) {
    text += "Now on the ground, with --stage drive and the same --out.\n";
  } else {
    const std::string reveal =
        options.hidden_effect ? reveal_text(improvement, runtime::HiddenEffect(*options.hidden_effect)) : "";
    improvement_page(improvement, reveal).write(options.out / "report.html");
    text += "report: " + (options.out / "report.html").string() + "\n";
    if (!reveal.empty()) text += "\n" + reveal;
  }
  if (!options.quiet) std::fputs(text.c_str(), stdout);
  return runtime::kExitOk;
}

Subcommand add_improve(CLI::App& app) {
  using Stage = ImproveOptions::Stage;
  const auto options = std::make_shared<ImproveOptions>();
  CLI::App* const command =
      app.add_subcommand("improve",
                         "find what the model of the wheels lacks, compensate it and drive better: "
                         "experiments, search, demo. ON A ROBOT THIS MOVES A MACHINE");
  command->footer(
      "On a real robot the wheels turn first, lifted off the ground; then the base drives the demo path and "
      "its mirror image, twice, each time from where it stands: keep 4 m by 4 m free, or carry it back. The "
      "program asks on the terminal before each part. Without a terminal, run --stage measure --yes, set the "
      "robot down, and run --stage drive --yes. The path error comes from the odometry of the wheels.\n"
      "A simulation in lock-step (youbot-sim --lock-step) is lifted and set down by this program.\n"
      "Exit codes: 0 done, 130 interrupted, 2 usage or configuration, 3 device, set-up or disk, 4 stopped by "
      "a "
      "fault.");
  command
      ->add_option("--hidden-effect", options->hidden_effect,
                   "seed of the hidden effect of the simulated robot in this program")
      ->check(runtime::finite_range(0, runtime::HiddenEffect::kMaxSeed));
  command->add_option("--robot", options->robot,
                      "ethercat:IFACE: a robot or youbot-sim, with the effects of its own drives");
  command->add_option("--config", options->config, "youbotd's TOML file for that robot; none: the demo's");
  command
      ->add_option("--stage", options->stage,
                   "measure, with the wheels off the ground, or drive, on the ground")
      ->transform(CLI::CheckedTransformer(
                      std::map<std::string, Stage>{{"measure", Stage::kMeasure}, {"drive", Stage::kDrive}})
                      .description("measure or drive"));
  command->add_flag("--virtual-time", options->virtual_time,
                    "as fast as both programs can; only with youbot-sim --lock-step");
  command->add_flag("--allow-non-rt", options->allow_non_real_time,
                    "continue when the system refuses real-time scheduling or memory locking");
  command->add_flag("--yes", options->yes, "with --stage: the robot may move, do not ask");
  command->add_option("--out", options->out, "directory for recordings, models and reports")->required();
  command
      ->add_option("--wheel", options->wheel,
                   "analyse this wheel and use its model for all four; none: each wheel gets its own")
      ->check(runtime::finite_range(1, 4));
  command->add_flag("--quiet", options->quiet, "print problems only");
  return {command, [options] { return improve(*options); }};
}

Subcommand add_reveal(CLI::App& app) {
  const auto seed = std::make_shared<std::uint64_t>(0);
  CLI::App* const command = app.add_subcommand(
      "reveal", "print the effect that --hidden-effect SEED injected: the solution of the blind test");
  command->add_option("--hidden-effect", *seed, "the seed")
      ->check(runtime::finite_range(0, runtime::HiddenEffect::kMaxSeed))
      ->required();
  return {command, [seed] {
            std::printf("%s\n", runtime::HiddenEffect(*seed).reveal().c_str());
            return runtime::kExitOk;
          }};
}

}  // namespace youbot_bench
