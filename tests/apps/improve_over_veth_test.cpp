// The whole chain over a wire: an emulated robot with a hidden effect at one end; at the other end the effect
// is measured, named and compensated, and the robot drives. In lock-step, so that a busy machine only makes
// it slower.
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <iterator>
#include <nlohmann/json.hpp>
#include <string>

#include "runtime/configuration/drive_model_file.h"
#include "runtime/configuration/hidden_effect.h"
#include "tests/support/built_paths.h"
#include "tests/support/run_command.h"
#include "tests/support/skip.h"
#include "tests/support/temporary_directory.h"
#include "tests/support/veth.h"

namespace improve_over_veth_test {

namespace fs = std::filesystem;

/// The demo's ways to drive, shorter.
constexpr const char* kConfig = R"([path]
rest_s = 0.5
[[path.leg]]
forward_m = 0.5
[[path.leg]]
left_m = 0.3
[[path.leg]]
forward_m = 0.3
turn_rad = 0.7
)";

class ImproveOverVeth : public testing::Test {
 protected:
  void SetUp() override { SKIP_UNLESS(namespaces_.usable(), "needs root and network namespaces"); }

  support::CommandResult improve(const std::string& arguments) const {
    return support::run_command(support::program("youbot-bench") +
                                " improve --robot ethercat:veth-c --wheel 1 --config " + config_.string() +
                                " --out " + out_.string() + " " + arguments);
  }
  std::string text_of(const std::string& file) const {
    std::ifstream stream(out_ / file);
    return {std::istreambuf_iterator<char>(stream), {}};
  }

  const support::Namespaces namespaces_;
  const support::TemporaryDirectory directory_;
  const fs::path out_ = directory_ / "new";
  const fs::path config_ = directory_.write("youbotd.toml", kConfig);
};

TEST_F(ImproveOverVeth, WhatTheRobotHidesIsNamedAndTheBaseDrivesCloserToItsPath) {
  const auto hidden = runtime::HiddenEffect(8).wheel_model();
  const auto* const truth = hidden.find<model::effects::Cogging>();
  ASSERT_NE(truth, nullptr);
  const support::Simulator simulator(namespaces_, "--robot base --lock-step --hidden-effect 8");
  ASSERT_TRUE(simulator.ready());
  const support::CommandResult result = improve("--virtual-time");
  ASSERT_EQ(result.exit_code, 0) << result.output;

  const auto findings = nlohmann::json::parse(text_of("wheel-1/gap.json"));
  ASSERT_FALSE(findings.at("effects").empty()) << findings;
  EXPECT_EQ(findings.at("effects").at(0).at("type"), "cogging");
  EXPECT_LT(findings.at("gap").at("after"), 0.2 * findings.at("gap").at("before").get<double>());
  const auto model = runtime::read_drive_model(out_ / "wheel-1/model.toml");
  const auto* const found = model.find<model::effects::Cogging>();
  ASSERT_NE(found, nullptr);
  EXPECT_NEAR(found->parameters().amplitude_Nm, truth->parameters().amplitude_Nm,
              0.05 * truth->parameters().amplitude_Nm);

  EXPECT_TRUE(result.said("The base drives better with the improved model")) << result.output;
  EXPECT_TRUE(result.said("off the path")) << result.output;
  const std::string page = text_of("report.html");
  for (const char* part : {"compensated with", "improved models", "Distance from the reference", "The path"})
    EXPECT_NE(page.find(part), std::string::npos) << part;
  EXPECT_EQ(page.find("What was hidden"), std::string::npos) << "it cannot know";
}

TEST_F(ImproveOverVeth, InVirtualTimeARobotThatGoesByTheClockIsLeftAlone) {
  const support::Simulator simulator(namespaces_, "--robot base --hidden-effect 3");
  ASSERT_TRUE(simulator.ready());
  const support::CommandResult result = improve("--virtual-time");
  EXPECT_EQ(result.exit_code, 3) << result.output;
  EXPECT_TRUE(result.said("check that it is simulated in lock-step")) << result.output;
  EXPECT_FALSE(fs::exists(out_ / "wheel-1"));
}

TEST_F(ImproveOverVeth, WhatMayBeARobotDoesNotMoveWithoutAWordAndNeverBothWaysUnwatched) {
  const support::CommandResult measuring = improve("");
  EXPECT_EQ(measuring.exit_code, 2);
  EXPECT_TRUE(measuring.said("ALL WHEELS WILL TURN")) << measuring.output;
  EXPECT_TRUE(measuring.said("add --stage measure --yes")) << measuring.output;
  const support::CommandResult both = improve("--yes");
  EXPECT_EQ(both.exit_code, 2);
  EXPECT_TRUE(both.said("no one would set the robot down")) << both.output;
  // Nothing was measured yet.
  const support::CommandResult driving = improve("--stage drive --yes");
  EXPECT_EQ(driving.exit_code, 2);
  EXPECT_TRUE(driving.said("--stage measure writes it")) << driving.output;
  for (const char* const file : {"new/wheel-1/base.toml", "new/wheel-1/model.toml"})
    directory_.write(file, runtime::drive_model_text(runtime::known_wheel_model()));
  const support::CommandResult unwatched = improve("--stage drive");
  EXPECT_EQ(unwatched.exit_code, 2);
  EXPECT_TRUE(unwatched.said("THE BASE WILL DRIVE")) << unwatched.output;
}

}  // namespace improve_over_veth_test
