#include "apps/youbot_bench/improve.h"

#include <spdlog/spdlog.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <array>
#include <atomic>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <deque>
#include <future>
#include <stdexcept>
#include <string_view>
#include <utility>

#include "apps/common/drive_model_file.h"
#include "apps/common/exit_code.h"
#include "apps/common/hidden_effect.h"
#include "apps/common/progress_line.h"
#include "apps/common/stop_on_signals.h"
#include "apps/common/whole_file.h"
#include "apps/youbot_bench/experiments_cli.h"
#include "apps/youbot_bench/improve_report.h"
#include "apps/youbot_gap/explain.h"
#include "apps/youbotd/config.h"
#include "apps/youbotd/demo_config.h"
#include "hal/setup_error.h"

namespace youbot_bench {
namespace {

namespace fs = std::filesystem;
using Words = std::vector<std::string>;

/// Shares of the whole work.
constexpr double kRecorded = 0.2;
constexpr double kExplained = 0.9;

/// What a lab would type, so that the data carries the question: speeds held in both directions, everything
/// at once, slowly through break-away, below it, and reversals from fast to slow.
const std::array<Words, 5>& experiments() {
  static const std::array<Words, 5> kExperiments{
      Words{"staircase", "--quantity", "velocity", "--step", "0.8", "--highest", "8", "--hold", "0.7"},
      Words{"multisine", "--periods", "3", "--highest", "1.5"},
      Words{"torque-ramp", "--rate", "0.03", "--rest", "1", "--repeats", "3"},
      Words{"presliding", "--periods", "1"}, Words{"reversals"}};
  return kExperiments;
}

std::string wheel_name(int wheel) { return "wheel-" + std::to_string(wheel); }

std::vector<int> explained_wheels(const ImproveOptions& options) {
  if (options.wheel != 0) return {options.wheel};
  return {1, 2, 3, 4};
}

void record(const Words& experiment, const ImproveOptions& options) {
  Words words = experiment;
  for (const std::string& word :
       {std::string("--quiet"), std::string("--hidden-effect"), std::to_string(options.hidden_effect),
        std::string("--out"), (options.out / "recordings").string()})
    words.push_back(word);
  std::ranges::reverse(words);  // as the parser takes them
  CLI::App app;
  ExperimentCommands commands(app);
  app.parse(std::move(words));
  if (commands.run() != apps::kExitOk)
    throw hal::SetupError("youbot-bench", "record the experiment " + experiment.front(), "see above");
}

void make_directory(const fs::path& path) {
  std::error_code error;
  fs::create_directories(path, error);
  if (error)
    throw std::invalid_argument("--out: cannot make the directory " + path.string() + ": " + error.message());
}

/// What is there belongs to another run, or was written by `identify` under the same names.
void make_new_directory(const fs::path& path) {
  make_directory(path);
  std::error_code error;
  if (!fs::is_empty(path, error) || error)
    throw std::invalid_argument("--out: " + path.string() + " is not empty; name a new directory");
}

/// Thrown through a search, which nothing else can stop.
struct Stopped {};

youbot_gap::GapOptions prepare_search(int wheel, const fs::path& out) {
  const fs::path directory = out / wheel_name(wheel);
  make_directory(directory);
  sim::effects::DriveModel model = apps::known_wheel_model();
  model.name = wheel_name(wheel);
  apps::write_whole_file(directory / "base.toml", apps::drive_model_text(model));
  youbot_gap::GapOptions search{.inputs = {.model = directory / "base.toml"}, .out = directory};
  for (const Words& experiment : experiments())
    search.inputs.data.push_back(out / "recordings" / experiment.front() / (wheel_name(wheel) + ".csv"));
  return search;
}

/// All wheels at once. @throws Stopped when the program is asked to end.
std::vector<youbot_gap::Findings> explain(const ImproveOptions& options, apps::ProgressLine& progress) {
  struct Search {
    youbot_gap::GapOptions options;
    youbot_gap::Inputs inputs;
    std::atomic<double> done{0};
    std::future<youbot_gap::Findings> findings;  // last: waits for its thread, which uses the others
  };
  std::deque<Search> searches;
  for (const int wheel : explained_wheels(options)) {
    Search& search = searches.emplace_back();
    search.options = prepare_search(wheel, options.out);
    search.inputs = youbot_gap::read_inputs(search.options.inputs);
    for (const std::string& warning : search.inputs.warnings) spdlog::warn("{}", warning);
  }
  for (Search& search : searches)
    search.findings = std::async(std::launch::async, [&search] {
      return youbot_gap::write_findings(search.inputs, search.options,
                                        [&search](std::string_view, double done) {
                                          if (apps::stop_requested) throw Stopped();
                                          search.done = done;
                                        });
    });
  std::vector<youbot_gap::Findings> findings;
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

/// The demo's configuration with a line more in one of its tables.
std::string with_line(std::string config, const std::string& table, const std::string& line) {
  const std::size_t header = config.find("\n[" + table + "]");
  if (header == std::string::npos) throw std::logic_error("the demo's configuration has no [" + table + "]");
  return config.insert(config.find('\n', header + 1) + 1, line + "\n");
}

control::PlanarPose pose_of(const std::array<double, 3>& values) { return {values[0], values[1], values[2]}; }

Run driven(const youbotd::Config& config, const fs::path& file) {
  Run run;
  youbotd::SessionOptions session;
  session.config_file = file;
  session.virtual_time = true;
  session.after_cycle = [&run, cycle = 0](const youbotd::CycleRecord& record) mutable {
    constexpr int kCyclesPerPoint = 50;
    if (cycle++ % kCyclesPerPoint != 0 || !std::isfinite(record.reference_W[0])) return;
    run.time_s.push_back(std::chrono::duration<double>(record.time).count());
    run.X_WB.push_back(pose_of(record.truth_W));
    run.reference_X_WB.push_back(pose_of(record.reference_W));
  };
  run.summary = youbotd::run_session(config, session, apps::stop_requested);
  return run;
}

/// Writes the configuration beside the models and drives what it says.
Drive drive(const ImproveOptions& options, const std::string& name, const std::string& model_file,
            const std::string& simulated_wheels) {
  std::string models;
  for (int wheel = 1; wheel <= 4; ++wheel)
    models += (wheel > 1 ? ", \"" : "\"") + wheel_name(options.wheel != 0 ? options.wheel : wheel) + "/" +
              model_file + "\"";
  std::string text =
      with_line(std::string(youbotd::kDemoConfig), "compensation", "models = [" + models + "]");
  text = with_line(std::move(text), "simulation", simulated_wheels);
  const fs::path file = options.out / ("youbotd-" + name + ".toml");
  apps::write_whole_file(file, text);

  youbotd::Config config = youbotd::load_config(file);
  Drive result;
  result.demo = driven(config, file);
  for (control::PlanarVector& displacement_B : config.path.displacements_B)
    displacement_B = displacement_B.cwiseProduct(control::PlanarVector(1, -1, -1));
  result.mirrored = driven(config, file);
  return result;
}

}  // namespace

Improvement run_chain(const ImproveOptions& options) {
  make_new_directory(options.out);
  apps::ProgressLine progress("youbot-bench improve", options.quiet);
  Improvement improvement;
  double done = 0;
  for (const Words& experiment : experiments()) {
    progress.show("recording " + experiment.front(), done);
    record(experiment, options);
    if (apps::stop_requested) return improvement;
    done += kRecorded / static_cast<double>(experiments().size());
  }
  try {
    improvement.wheels = explain(options, progress);
  } catch (const Stopped&) {
    return improvement;
  }
  progress.show("driving with the known model", kExplained);
  const std::string known = wheel_name(explained_wheels(options).front()) + "/base.toml";
  const std::string hiding = "hidden_effect = " + std::to_string(options.hidden_effect);
  improvement.nothing_hidden = drive(options, "nothing-hidden", "base.toml", "model = \"" + known + "\"");
  improvement.base = drive(options, "base", "base.toml", hiding);
  progress.show("driving with the improved model", (1 + kExplained) / 2);
  improvement.improved = drive(options, "improved", "model.toml", hiding);
  progress.show("done", 1);
  progress.finish();
  return improvement;
}

int improve(const ImproveOptions& options) {
  apps::stop_on_signals();
  const Improvement improvement = run_chain(options);
  if (apps::stop_requested) {
    spdlog::info("stopped on request, nothing to compare");
    return apps::kExitOk;
  }
  int code = apps::kExitOk;
  for (const Drive* drive : {&improvement.nothing_hidden, &improvement.base, &improvement.improved})
    for (const Run* run : {&drive->demo, &drive->mirrored}) {
      if (run->summary.stop_reason.empty()) continue;
      spdlog::error("a drive was stopped by a fault at {}", run->summary.stop_reason);
      code = apps::kExitFault;
    }
  const apps::HiddenEffect hidden(options.hidden_effect);
  improvement_page(improvement, hidden).write(options.out / "report.html");
  if (options.quiet) return code;
  std::fputs(improvement_text(improvement).c_str(), stdout);
  std::printf("report: %s\n\n", (options.out / "report.html").c_str());
  std::fputs(reveal_text(improvement, hidden).c_str(), stdout);
  return code;
}

}  // namespace youbot_bench
