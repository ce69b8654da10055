// An effect that nobody was told of: drawn from a seed, and kept to itself until somebody asks.
#include "apps/common/hidden_effect.h"

#include <gtest/gtest.h>
#include <sys/wait.h>

#include <array>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <set>
#include <string>
#include <string_view>

#include "apps/common/drive_model_file.h"
#include "sim/effects/effect_chain.h"

namespace apps {
namespace {

namespace fs = std::filesystem;

std::string text_of(const fs::path& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), {}};
}

struct Result {
  int exit_code = -1;
  std::string output{};  ///< both streams
};
Result run(const std::string& command) {
  Result result;
  FILE* const pipe = popen((command + " 2>&1 < /dev/null").c_str(), "r");
  std::array<char, 512> line{};
  while (pipe != nullptr && fgets(line.data(), line.size(), pipe) != nullptr) result.output += line.data();
  const int status = pipe != nullptr ? pclose(pipe) : -1;
  if (WIFEXITED(status)) result.exit_code = WEXITSTATUS(status);
  return result;
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
    kinds.insert(std::string(sim::effects::name_of(hidden.effect())));
    models.insert(drive_model_text(hidden.wheel_model()));
    // The wheels can still be turned: friction stays positive at all speeds of the base.
    const sim::effects::EffectChain chain(hidden.wheel_model().effects);
    for (double speed = 0; speed < 10; speed += 0.1)
      for (const double direction : {-1.0, 1.0}) {
        EXPECT_GT(chain.level_Nm(speed, direction, 1e4, 0), 0.01) << hidden.reveal();
      }
  }
  EXPECT_GE(kinds.size(), 10U);
  EXPECT_EQ(models.size(), kSeeds);
}

class HiddenEffectCommands : public testing::Test {
 protected:
  void SetUp() override {
    directory_ =
        fs::path(testing::TempDir()) /
        ("hidden_effect_" + std::string(testing::UnitTest::GetInstance()->current_test_info()->name()));
    fs::remove_all(directory_);
    fs::create_directories(directory_);
    std::ofstream(directory_ / "wheel.toml") << drive_model_text(known_wheel_model());
  }
  void TearDown() override { fs::remove_all(directory_); }
  std::string path(const std::string& name) const { return (directory_ / name).string(); }
  static Result bench(const std::string& arguments) {
    return run(std::string(YOUBOT_BENCH_BINARY) + " " + arguments);
  }

  fs::path directory_;
};

TEST_F(HiddenEffectCommands, WheelsFollowAModelOrHideAnEffectNotBoth) {
  const std::string both = " --hidden-effect 3 --model " + path("wheel.toml");
  const Result experiment = bench("presliding --quiet --out " + path("out") + both);
  EXPECT_EQ(experiment.exit_code, 2);
  EXPECT_NE(experiment.output.find("--hidden-effect and --model"), std::string::npos) << experiment.output;
  EXPECT_FALSE(fs::exists(path("out")));
  const Result robot = run(std::string(YOUBOT_SIM_BINARY) + " --interface nosuch0" + both);
  EXPECT_EQ(robot.exit_code, 2);
  EXPECT_NE(robot.output.find("--hidden-effect and --model"), std::string::npos) << robot.output;
  // One of them alone gets as far as the interface.
  EXPECT_EQ(run(std::string(YOUBOT_SIM_BINARY) + " --interface nosuch0 --hidden-effect 3").exit_code, 3);
}

TEST_F(HiddenEffectCommands, OnlyASimulatedRobotHidesAnything) {
  const Result result =
      bench("presliding --quiet --yes --robot can:nosuch0 --hidden-effect 3 --out " + path("out"));
  EXPECT_EQ(result.exit_code, 2);
  EXPECT_NE(result.output.find("--hidden-effect: only a simulated robot"), std::string::npos)
      << result.output;
  EXPECT_EQ(bench("presliding --quiet --hidden-effect tree --out " + path("out")).exit_code, 2);
}

TEST_F(HiddenEffectCommands, NothingSaysWhatItIsBeforeSomebodyAsks) {
  // 3 is an imbalance.
  const Result result = bench(
      "multisine --periods 1 --period 2 --lowest 0.5 --joint wheel-1 --hidden-effect 3 --out " + path("out"));
  ASSERT_EQ(result.exit_code, 0) << result.output;
  std::string everything = result.output;
  for (const auto& entry : fs::recursive_directory_iterator(path("out")))
    if (entry.is_regular_file()) everything += text_of(entry.path());
  // What else goes by an effect's name: the robot's inertia, an experiment, a key of [ethercat].
  const std::set<std::string_view> other_meanings{"inertia", "presliding", "unsigned_current"};
  for (const sim::effects::EffectDescription& effect : sim::effects::effect_descriptions())
    if (!other_meanings.contains(effect.name)) {
      EXPECT_EQ(everything.find(effect.name), std::string::npos) << effect.name;
    }
  const std::string made_by = text_of(path("out") + "/multisine/experiment.toml");
  EXPECT_NE(made_by.find("\nhidden_effect = 3 "), std::string::npos) << made_by;

  const Result asked = bench("reveal --hidden-effect 3");
  EXPECT_EQ(asked.exit_code, 0);
  EXPECT_NE(asked.output.find("imbalance: torque"), std::string::npos) << asked.output;
}

TEST_F(HiddenEffectCommands, ARecordingMadeAgainFromItsFileHidesTheSame) {
  const std::string experiment =
      "multisine --quiet --periods 1 --period 2 --lowest 0.5 --joint wheel-1 --out ";
  const auto recorded = [&](const std::string& name, const std::string& options) {
    const Result result = bench(experiment + path(name) + options);
    EXPECT_EQ(result.exit_code, 0) << result.output;
    return text_of(path(name) + "/multisine/wheel-1.csv");
  };
  const std::string first = recorded("first", " --hidden-effect 3");
  EXPECT_EQ(recorded("again", " --config " + path("first") + "/multisine/experiment.toml"), first);
  EXPECT_NE(recorded("other", " --hidden-effect 8"), first);
}

}  // namespace
}  // namespace apps
