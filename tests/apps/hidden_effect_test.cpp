// A hidden effect: drawn from a seed, and not disclosed until requested.
#include "runtime/configuration/hidden_effect.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <set>
#include <string>
#include <string_view>

#include "model/effects/effect_chain.h"
#include "runtime/configuration/drive_model_file.h"
#include "tests/support/built_paths.h"
#include "tests/support/run_command.h"
#include "tests/support/temporary_directory.h"
#include "tests/support/without_start.h"

namespace runtime {
namespace hidden_effect_test {

namespace fs = std::filesystem;
using support::CommandResult;
using support::run_command;

std::string text_of(const fs::path& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), {}};
}

TEST(HiddenEffect, TheSameSeedHidesTheSameOnEveryMachine) {
  for (const std::uint64_t seed : {0U, 1U, 77U, 4'000'000'000U})
    EXPECT_EQ(drive_model_text(HiddenEffect(seed).wheel_model()),
              drive_model_text(HiddenEffect(seed).wheel_model()));
  // The engine's numbers are the standard's, and there is nothing but products and sums behind: 3 of 4
  // digits.
  EXPECT_EQ(HiddenEffect(3).reveal(), "imbalance: torque 0.0179 N·m, rest position 0.567 rad");
}

TEST(HiddenEffect, SeedsDrawSeveralKindsInDifferentSizesAndAlwaysOneEffect) {
  std::set<std::string> kinds;
  std::set<std::string> models;
  const std::size_t known = known_wheel_model().effects.size();
  constexpr std::uint64_t kSeeds = 200;
  for (std::uint64_t seed = 0; seed < kSeeds; ++seed) {
    const HiddenEffect hidden(seed);
    ASSERT_EQ(hidden.wheel_model().effects.size(), known + 1);
    kinds.insert(std::string(model::effects::name_of(hidden.effect())));
    models.insert(drive_model_text(hidden.wheel_model()));
    // The wheels can still be turned: friction stays positive at all speeds of the base.
    const model::effects::EffectChain chain(hidden.wheel_model().effects);
    for (double speed = 0; speed < 10; speed += 0.1)
      for (const double direction : {-1.0, 1.0}) {
        EXPECT_GT(chain.level_Nm({.speed_rad_per_s = speed, .direction = direction, .running_s = 1e4}), 0.01)
            << hidden.reveal();
      }
  }
  EXPECT_GE(kinds.size(), 10U);
  EXPECT_EQ(models.size(), kSeeds);
}

class HiddenEffectCommands : public testing::Test {
 protected:
  HiddenEffectCommands() { directory_.write("wheel.toml", drive_model_text(known_wheel_model())); }
  std::string path(const std::string& name) const { return (directory_ / name).string(); }
  static CommandResult bench(const std::string& arguments) {
    return run_command(support::program("youbot-bench") + " " + arguments);
  }

  support::TemporaryDirectory directory_;
};

TEST_F(HiddenEffectCommands, WheelsFollowAModelOrHideAnEffectNotBoth) {
  const std::string both = " --hidden-effect 3 --model " + path("wheel.toml");
  const CommandResult experiment = bench("presliding --quiet --out " + path("out") + both);
  EXPECT_EQ(experiment.exit_code, 2);
  EXPECT_NE(experiment.output.find("--hidden-effect and --model"), std::string::npos) << experiment.output;
  EXPECT_FALSE(fs::exists(path("out")));
  const CommandResult robot = run_command(support::program("youbot-sim") + " --interface nosuch0" + both);
  EXPECT_EQ(robot.exit_code, 2);
  EXPECT_NE(robot.output.find("--hidden-effect and --model"), std::string::npos) << robot.output;
  // One of them alone gets as far as the interface.
  EXPECT_EQ(run_command(support::program("youbot-sim") + " --interface nosuch0 --hidden-effect 3").exit_code,
            3);
}

TEST_F(HiddenEffectCommands, OnlyASimulatedRobotHidesAnything) {
  const CommandResult result =
      bench("presliding --quiet --yes --robot can:nosuch0 --hidden-effect 3 --out " + path("out"));
  EXPECT_EQ(result.exit_code, 2);
  EXPECT_NE(result.output.find("--hidden-effect: only a simulated robot"), std::string::npos)
      << result.output;
  EXPECT_EQ(bench("presliding --quiet --hidden-effect tree --out " + path("out")).exit_code, 2);
}

TEST_F(HiddenEffectCommands, ASeedIsAWholeNumberFromZero) {
  for (const char* seed : {"-1", "3.5", "tree", "2000000001", "99999999999999999999", "''"}) {
    EXPECT_EQ(bench(std::string("reveal --hidden-effect ") + seed).exit_code, 2) << seed;
    EXPECT_EQ(run_command(support::program("youbot-sim") + " --interface nosuch0 --hidden-effect " + seed)
                  .exit_code,
              2)
        << seed;
    if (std::string_view(seed) == "-1") continue;  // none, as experiment.toml has it
    EXPECT_EQ(
        bench(std::string("staircase --quiet --hidden-effect ") + seed + " --out " + path("out")).exit_code,
        2)
        << seed;
  }
  EXPECT_TRUE(bench("staircase --hidden-effect 3000000000 --out " + path("out"))
                  .said("--hidden-effect: should be -1 to 2e+09, not 3000000000"));
  EXPECT_TRUE(bench("staircase --hidden-effect 3.5 --out " + path("out")).said("--hidden-effect = 3.5"));
  EXPECT_FALSE(fs::exists(path("out")));
}

TEST_F(HiddenEffectCommands, StaysHiddenUntilItIsRequested) {
  // 3 is an imbalance.
  const CommandResult result = bench(
      "multisine --periods 1 --period 2 --lowest 0.5 --joint wheel-1 --hidden-effect 3 --out " + path("out"));
  ASSERT_EQ(result.exit_code, 0) << result.output;
  std::string everything = result.output;
  for (const auto& entry : fs::recursive_directory_iterator(path("out")))
    if (entry.is_regular_file()) everything += text_of(entry.path());
  // What else goes by an effect's name: the robot's inertia, an experiment, a key of [ethercat].
  const std::set<std::string_view> other_meanings{"inertia", "presliding", "unsigned_current"};
  for (const model::effects::EffectDescription& effect : model::effects::effect_descriptions())
    if (!other_meanings.contains(effect.name)) {
      EXPECT_EQ(everything.find(effect.name), std::string::npos) << effect.name;
    }
  const std::string made_by = text_of(path("out") + "/multisine/experiment.toml");
  EXPECT_NE(made_by.find("\nhidden_effect = 3 "), std::string::npos) << made_by;

  const CommandResult asked = bench("reveal --hidden-effect 3");
  EXPECT_EQ(asked.exit_code, 0);
  EXPECT_NE(asked.output.find("imbalance: torque"), std::string::npos) << asked.output;
}

TEST_F(HiddenEffectCommands, ARecordingMadeAgainFromItsFileHidesTheSame) {
  const std::string experiment =
      "multisine --quiet --periods 1 --period 2 --lowest 0.5 --joint wheel-1 --out ";
  const auto recorded = [&](const std::string& name, const std::string& options) {
    const CommandResult result = bench(experiment + path(name) + options);
    EXPECT_EQ(result.exit_code, 0) << result.output;
    return support::without_start(text_of(path(name) + "/multisine/wheel-1.csv"));
  };
  const std::string first = recorded("first", " --hidden-effect 3");
  EXPECT_EQ(recorded("again", " --config " + path("first") + "/multisine/experiment.toml"), first);
  EXPECT_NE(recorded("other", " --hidden-effect 8"), first);
}

}  // namespace hidden_effect_test
}  // namespace runtime
