// The next experiment as youbot-gap prints it: a complete command. And the tour of its README.
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <limits>
#include <nlohmann/json.hpp>
#include <set>
#include <sstream>
#include <string>
#include <vector>

#include "analysis/findings.h"
#include "apps/youbot_bench/experiment_request.h"
#include "identification/gap/bench_experiments.h"
#include "runtime/configuration/drive_model_file.h"
#include "runtime/configuration/hidden_effect.h"
#include "tests/support/built_paths.h"
#include "tests/support/run_command.h"
#include "tests/support/temporary_directory.h"

namespace next_experiment_command_test {

namespace fs = std::filesystem;
using support::CommandResult;

/// As a shell finds programs that are installed.
CommandResult typed(const std::string& command, const fs::path& directory) {
  return support::run_command("cd '" + directory.string() + "' && PATH='" + support::program_dir() +
                              "':$PATH " + command);
}

// One of each kind, the shortest ones of the loopback robot's limits.
TEST(NextExperimentCommand, RunsAsItIsPrintedOnTheLoopbackRobot) {
  const identification::gap::DriveLimits limits{
      .torque_Nm = 0.25, .speed_rad_per_s = 8, .travel_rad = std::numeric_limits<double>::infinity()};
  const analysis::Findings findings{
      .base = {}, .base_path = {}, .drive = "wheel-1", .data = {}, .result = {}};
  std::set<std::string> names;
  for (const auto& experiment :
       identification::gap::bench_experiments(runtime::known_wheel_model(), limits)) {
    if (!names.insert(experiment.name).second) continue;
    const std::string command =
        analysis::command_text({.name = experiment.name, .settings = experiment.settings}, findings);
    const support::TemporaryDirectory directory;
    const CommandResult result = typed(command, directory / ".");
    EXPECT_EQ(result.exit_code, 0) << command << '\n' << result.output;
    EXPECT_TRUE(fs::exists(directory / ("next-experiment/" + experiment.name + "/wheel-1.csv"))) << command;
  }
  EXPECT_EQ(names, (std::set<std::string>{"dahl", "multisine", "presliding", "reversals", "staircase",
                                          "steady-state", "stick-slip", "torque-ramp"}));
}

// youbot-bench does not stop a planned experiment.
TEST(NextExperimentCommand, ThePlanKnowsWhereTheBenchStops) {
  const std::vector<youbot_bench::ExperimentRequest> requests = youbot_bench::experiment_requests();
  for (const double speed_rad_per_s : {8.0, 15.9, 40.0}) {
    const identification::gap::DriveLimits limits{.torque_Nm = 0.25,
                                                  .speed_rad_per_s = speed_rad_per_s,
                                                  .travel_rad = std::numeric_limits<double>::infinity()};
    for (const auto& planned : identification::gap::bench_experiments(runtime::known_wheel_model(), limits)) {
      SCOPED_TRACE(planned.name);
      const auto request =
          std::ranges::find_if(requests, [&](const auto& known) { return planned.name == known.name; });
      ASSERT_NE(request, requests.end());
      double top_rad_per_s = request->settings.max_speed_rad_per_s;
      for (const auto& [key, value] : planned.settings)
        if (key == "max_speed_rad_per_s") top_rad_per_s = std::stod(value);
      EXPECT_EQ(planned.stops.speed_rad_per_s, top_rad_per_s);
      EXPECT_LE(top_rad_per_s, 30);
      const double travel_rad = request->settings.max_travel_rad;
      EXPECT_EQ(planned.stops.travel_rad,
                travel_rad > 0 ? travel_rad : std::numeric_limits<double>::infinity());
    }
  }
}

TEST(NextExperimentCommand, AnArmsJointIsMeasuredAlone) {
  const analysis::Findings findings{.base = {}, .base_path = {}, .drive = "arm-2", .data = {}, .result = {}};
  EXPECT_EQ(
      analysis::command_text({.name = "reversals", .settings = {{"highest_rad_per_s", "0.4"}}}, findings),
      "youbot-bench reversals --kind base+arm --joint arm-2 --highest 0.4 --out next-experiment");
}

TEST(GapTour, TheModelIsThatOfTheWheelsThatHideAnEffect) {
  const model::effects::DriveModel file =
      runtime::read_drive_model(fs::path(support::source_dir()) / "apps/youbot_gap/known_wheel.toml");
  const model::effects::DriveModel known = runtime::known_wheel_model();
  EXPECT_EQ(file.inertia_kg_m2, known.inertia_kg_m2);
  ASSERT_EQ(file.effects.size(), known.effects.size());
  for (std::size_t i = 0; i < known.effects.size(); ++i) {
    const std::string_view name = model::effects::name_of(known.effects[i]);
    ASSERT_EQ(model::effects::name_of(file.effects[i]), name);
    for (const auto& parameter : model::effects::effect_description(name).parameters)
      EXPECT_EQ(model::effects::parameter_of(file.effects[i], parameter.name),
                model::effects::parameter_of(known.effects[i], parameter.name))
          << name << ' ' << parameter.name;
  }
}

TEST(GapTour, EndsWithTheHiddenEffectExplained) {
  const support::TemporaryDirectory directory;
  const std::string options = " --hidden-effect 8 --joint wheel-1 --quiet --out recorded";
  for (const char* const experiment : {"multisine", "staircase"})
    ASSERT_EQ(typed(std::string("youbot-bench ") + experiment + options, directory / ".").exit_code, 0);
  const CommandResult gap =
      typed("youbot-gap --model '" + support::source_dir() +
                "/apps/youbot_gap/known_wheel.toml' --out explained --data recorded/multisine/wheel-1.csv "
                "recorded/staircase/wheel-1.csv",
            directory / ".");
  ASSERT_EQ(gap.exit_code, 0) << gap.output;
  EXPECT_TRUE(gap.said("wheel-1: explained")) << gap.output;
  const CommandResult hidden = typed("youbot-bench reveal --hidden-effect 8", directory / ".");
  EXPECT_TRUE(hidden.said("cogging")) << hidden.output;
  EXPECT_TRUE(gap.said("+ cogging")) << gap.output;
}

}  // namespace next_experiment_command_test
