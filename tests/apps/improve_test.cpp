// The whole chain: measure, explain, compensate, drive.
#include "apps/youbot_bench/improve.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <string>
#include <string_view>

#include "apps/youbot_bench/improve_report.h"
#include "runtime/configuration/drive_model_file.h"
#include "runtime/configuration/hidden_effect.h"
#include "tests/support/built_paths.h"
#include "tests/support/run_command.h"
#include "tests/support/temporary_directory.h"

namespace youbot_bench {
namespace improve_test {

namespace fs = std::filesystem;

class Improve : public testing::Test {
 protected:
  /// One wheel represents all: a search takes seconds.
  Improvement chain(std::uint64_t seed) const {
    return run_chain({.hidden_effect = seed, .out = directory_, .wheel = 1, .quiet = true});
  }

  /// Without the standard error, where progress goes.
  support::CommandResult run(const std::string& arguments) const {
    return support::run_command(support::program("youbot-bench") + " improve " + arguments + " --out " +
                                directory_.string() + " 2> /dev/null");
  }

  support::TemporaryDirectory temporary_;
  const fs::path directory_ = temporary_ / "new";  // made by the chain
};

/// What any seed must do whose effect a compensator can act on.
void expect_better(const Improvement& improvement, std::string_view effect) {
  ASSERT_EQ(improvement.wheels.size(), 1U);
  const identification::gap::Result& result = improvement.wheels.front().result;
  ASSERT_FALSE(result.effects.empty());
  EXPECT_EQ(model::effects::name_of(result.effects.front().effect), effect);
  EXPECT_LT(result.gap_after_Nm, 0.2 * result.gap_before_Nm);
  // Closer to the path, and most of the effect on the drive is compensated.
  EXPECT_TRUE(less(path_error_m(improvement.improved), path_error_m(improvement.base)))
      << improvement_text(improvement);
  ASSERT_TRUE(improvement.nothing_hidden);
  EXPECT_LT(apart_m(improvement.improved, *improvement.nothing_hidden),
            0.3 * apart_m(improvement.base, *improvement.nothing_hidden));
  EXPECT_NE(improvement_text(improvement).find("The base drives better with the improved model"),
            std::string::npos);
}

TEST_F(Improve, ARobotOnABusIgnoresTheArmFileOfTheSimulation) {
  const fs::path config =
      temporary_.write("lab.toml",
                       "[ethercat]\nkind = \"base+arm\"\n[path]\n[[path.leg]]\nforward_m = 0.1\n"
                       "[simulation]\nrobot_file = \"" +
                           support::source_dir() + "/control/youbot_arm.toml\"\n");
  for (const char* const file : {"new/wheel-1/base.toml", "new/wheel-1/model.toml"})
    temporary_.write(file, runtime::drive_model_text(runtime::known_wheel_model()));
  const support::CommandResult driving = support::run_command(
      support::program("youbot-bench") +
      " improve --robot ethercat:none0 --wheel 1 --stage drive --yes --allow-non-rt --config " +
      config.string() + " --out " + directory_.string());
  EXPECT_EQ(driving.exit_code, 3) << driving.output;
  EXPECT_TRUE(driving.said("none0")) << driving.output;
}

// Found after minutes of measuring otherwise, when the drives read a copy of the file in --out.
TEST_F(Improve, AFileWhoseCopyCouldNotBeDrivenIsRefusedBeforeTheMeasurement) {
  temporary_.write("wheel.toml", runtime::drive_model_text(runtime::known_wheel_model()));
  for (const char* const file : {"youbot_arm.toml", "youbot.urdf"})
    fs::copy_file(fs::path(support::source_dir()) / "control" / file, temporary_ / file);
  const auto expect_refused = [&](const std::string& config, const char* why) {
    const support::CommandResult result = support::run_command(
        support::program("youbot-bench") + " improve --robot ethercat:none0 --stage measure --yes --config " +
        temporary_.write("lab.toml", config).string() + " --out " + directory_.string());
    EXPECT_EQ(result.exit_code, 2) << result.output;
    EXPECT_TRUE(result.said(why)) << result.output;
    EXPECT_FALSE(fs::exists(directory_));
  };
  expect_refused("[path]\nspeed = 1\n", "lab.toml:2");
  expect_refused(
      "[compensation]\nmodels = [\"wheel.toml\", \"wheel.toml\", \"wheel.toml\", \"wheel.toml\"]\n",
      "remove 'models' from [compensation]");
  expect_refused("[ethercat]\nkind = \"base+arm\"\n[simulation]\nrobot_file = \"youbot_arm.toml\"\n",
                 "give the absolute path of 'youbot_arm.toml'");
}

TEST_F(Improve, ACoggingIsFoundCompensatedAndDrivenBetter) {
  ASSERT_EQ(model::effects::name_of(runtime::HiddenEffect(8).effect()), "cogging");
  expect_better(chain(8), "cogging");
  for (const char* file : {"wheel-1/base.toml", "wheel-1/gap.json", "wheel-1/report.html",
                           "youbotd-base.toml", "youbotd-improved.toml", "recordings/reversals/wheel-4.csv"})
    EXPECT_TRUE(fs::exists(directory_ / file)) << file;
}

TEST_F(Improve, TheCommandNamesAnImbalanceDrivesBetterAndRevealsItLast) {
  const runtime::HiddenEffect hidden(3);
  const auto* const truth = hidden.wheel_model().find<model::effects::Imbalance>();
  ASSERT_NE(truth, nullptr);
  const support::CommandResult result = run("--wheel 1 --hidden-effect 3");
  const std::string& output = result.output;
  ASSERT_EQ(result.exit_code, 0) << output;
  for (const char* said : {"imbalance", "The base drives better with the improved model"})
    EXPECT_TRUE(result.said(said)) << said << "\nin\n" << output;
  const std::size_t at = output.find("Hidden was " + hidden.reveal());
  ASSERT_NE(at, std::string::npos) << output;
  EXPECT_EQ(output.find('\n', at), output.size() - 1) << output;
  EXPECT_TRUE(fs::exists(directory_ / "report.html"));

  const auto model = runtime::read_drive_model(directory_ / "wheel-1/model.toml");
  const auto* const found = model.find<model::effects::Imbalance>();
  ASSERT_NE(found, nullptr);
  EXPECT_NEAR(found->parameters().torque_Nm, truth->parameters().torque_Nm,
              0.05 * truth->parameters().torque_Nm);
  // A second time there is a run already, which is not replaced.
  EXPECT_EQ(run("--wheel 1 --hidden-effect 3").exit_code, 2);
  EXPECT_TRUE(runtime::read_drive_model(directory_ / "wheel-1/model.toml").find<model::effects::Imbalance>());
}

TEST_F(Improve, WhatIsInADirectoryAlreadyIsNotWrittenOver) {
  // Where README's `identify` writes.
  temporary_.write("new/wheel-1/model.toml", "mine");
  const support::CommandResult result = support::run_command(
      support::program("youbot-bench") + " improve --hidden-effect 3 --out " + directory_.string());
  EXPECT_EQ(result.exit_code, 2);
  EXPECT_TRUE(result.said("is not empty; name a new directory")) << result.output;
  EXPECT_EQ(fs::file_size(directory_ / "wheel-1/model.toml"), 4U);
  EXPECT_FALSE(fs::exists(directory_ / "recordings"));
}

TEST_F(Improve, EndsSoonWhenItIsAskedToInTheMiddleOfTheSearch) {
  // The search of four wheels takes many seconds on two cores.
  const support::CommandResult result = support::run_command(
      support::program("youbot-bench") + " improve --hidden-effect 3 --out " + directory_.string() +
      " & improve=$!; until test -e " + (directory_ / "wheel-4/base.toml").string() +
      " || ! kill -0 $improve; do sleep 0.05; done; kill -INT $improve; wait $improve");
  EXPECT_EQ(result.exit_code, 130) << result.output;
  EXPECT_TRUE(result.said("stopped on request, nothing to compare")) << result.output;
  EXPECT_FALSE(fs::exists(directory_ / "report.html"));
  EXPECT_FALSE(fs::exists(directory_ / "youbotd-base.toml"));
}

TEST_F(Improve, WrongUseIsRefusedBeforeAnythingIsMade) {
  for (const char* const wrong : {"", "--hidden-effect tree", "--hidden-effect -1", "--hidden-effect 3.5",
                                  "--hidden-effect 99999999999999999999", "--hidden-effect 3 --wheel 5",
                                  "--hidden-effect 3 --model wheel.toml"})
    EXPECT_EQ(run(wrong).exit_code, 2) << wrong;
  EXPECT_FALSE(fs::exists(directory_));
}

}  // namespace improve_test
}  // namespace youbot_bench
