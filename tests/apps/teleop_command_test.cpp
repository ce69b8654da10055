// The command `youbotd` with a haptic device: demo, arguments, exit codes, messages.
#include <gtest/gtest.h>

#include <filesystem>
#include <initializer_list>
#include <string>

#include "operation/teleop_demo.h"
#include "tests/support/built_paths.h"
#include "tests/support/run_command.h"
#include "tests/support/temporary_directory.h"

namespace teleop_command_test {

namespace fs = std::filesystem;
using support::CommandResult;

const std::string kTeleop = support::source_dir() + "/apps/youbotd/teleop.toml";
const std::string kBaseOnly = support::source_dir() + "/apps/youbotd/demo.toml";

CommandResult youbotd(const std::string& config, const std::string& arguments) {
  return support::run_command(support::program("youbotd") + " --config " + config + " " + arguments);
}

TEST(TeleopCommand, TheDemoReportsHowEachTaskEndedAndTheForceOnTheHand) {
  const CommandResult result = youbotd(kTeleop, "--demo --virtual-time");
  EXPECT_EQ(result.exit_code, 0) << result.output;
  EXPECT_TRUE(result.said("running loopback by hand on loopback, 1000 Hz, virtual time")) << result.output;
  EXPECT_TRUE(result.said("phases       centring 0.0 s, unfolding ")) << result.output;
  // A line for each task, in their order.
  std::size_t at = result.output.find("operator\n");
  ASSERT_NE(at, std::string::npos) << result.output;
  at += std::string("operator\n").size();
  for (const sim::Task& task : operation::demo_tasks()) {
    const std::string line = result.output.substr(at, result.output.find('\n', at) - at);
    EXPECT_TRUE(line.starts_with("  " + std::string(sim::name_of(task)) + " ")) << line;
    EXPECT_NE(line.find(" done "), std::string::npos) << line;
    EXPECT_NE(line.find("felt up to "), std::string::npos) << line;
    at += line.size() + 1;
  }
  EXPECT_EQ(result.output.compare(at, 4, "hand"), 0) << result.output.substr(at);
  EXPECT_TRUE(result.said("off the path")) << result.output;
}

TEST(TeleopCommand, TheQuietDemoSaysNothing) {
  const CommandResult result = youbotd(kTeleop, "--demo --virtual-time --quiet");
  EXPECT_EQ(result.exit_code, 0);
  EXPECT_EQ(result.output, "");
}

TEST(TeleopCommand, HelpNamesTheMasters) {
  const CommandResult result = support::run_command(support::program("youbotd") + " --help");
  EXPECT_EQ(result.exit_code, 0);
  for (const char* word : {"--haptic", "loopback", "force-dimension", "falcon", "spacemouse", "teleop.toml"})
    EXPECT_TRUE(result.said(word)) << word;
}

TEST(TeleopCommand, AnUnknownMasterIsAnsweredWithAllThatExist) {
  const CommandResult result = youbotd(kTeleop, "--haptic nonsense");
  EXPECT_EQ(result.exit_code, 2);
  for (const char* word : {"nonsense", "loopback, force-dimension or omega.6, falcon, spacemouse"})
    EXPECT_TRUE(result.said(word)) << result.output;
  EXPECT_EQ(youbotd(kTeleop, "--haptic ''").exit_code, 2);
}

TEST(TeleopCommand, TheOmega6IsCalledByItsNameToo) {
  const CommandResult result = youbotd(kTeleop, "--haptic omega.6 --allow-non-rt --duration 1");
  EXPECT_EQ(result.exit_code, 3) << "no device, or no library of its vendor" << result.output;
  EXPECT_FALSE(result.said("there is no 'omega.6'")) << result.output;
}

TEST(TeleopCommand, AMasterThatIsNotThereIsNamedWithWhatToDo) {
  const support::TemporaryDirectory directory;
  // At a port that no machine has: a Falcon that is there is left alone.
  const fs::path config = directory.write(
      "falcon.toml", "[ethercat]\nkind = \"base+arm\"\n[haptic.falcon]\nusb_port = \"99-9\"\n");
  const CommandResult result = youbotd(config, "--haptic falcon --allow-non-rt --duration 1");
  EXPECT_EQ(result.exit_code, 3) << result.output;
  for (const char* word : {"Novint Falcon", "99-9", "check that it is switched on"})
    EXPECT_TRUE(result.said(word)) << word << "\n" << result.output;
}

TEST(TeleopCommand, AMasterMakesAHandMoveTheRobotWhateverTheFileSays) {
  const support::TemporaryDirectory directory;
  const fs::path config = directory.write("robot.toml", "[ethercat]\nkind = \"base+arm\"\n");
  const CommandResult result = youbotd(config, "--haptic loopback --virtual-time --duration 0.1");
  EXPECT_EQ(result.exit_code, 0) << result.output;
  EXPECT_TRUE(result.said("by hand on loopback")) << result.output;
  EXPECT_TRUE(result.said("centring")) << result.output;
  EXPECT_FALSE(result.said("operator")) << "without --demo he has nothing to do: " << result.output;
}

TEST(TeleopCommand, ABaseWithoutAnArmIsRefusedWithTheKeyToSet) {
  const CommandResult result = youbotd(kBaseOnly, "--haptic loopback --virtual-time");
  EXPECT_EQ(result.exit_code, 2);
  EXPECT_TRUE(result.said("set ethercat.kind = \"base+arm\"")) << result.output;
}

TEST(TeleopCommand, TheOperatorOfTheDemoIsForTheSimulatedPenOnly) {
  const CommandResult real = youbotd(kTeleop, "--haptic falcon --demo");
  EXPECT_EQ(real.exit_code, 2);
  EXPECT_TRUE(real.said("--haptic loopback")) << real.output;
  const CommandResult virtual_time = youbotd(kTeleop, "--haptic falcon --virtual-time");
  EXPECT_EQ(virtual_time.exit_code, 2);
  EXPECT_TRUE(virtual_time.said("falcon lives in real time")) << virtual_time.output;
}

TEST(TeleopCommand, AConfigurationThatCannotBeIsRefusedBeforeAnythingMoves) {
  const support::TemporaryDirectory directory;
  const fs::path far = directory.write(
      "far.toml", "[ethercat]\nkind = \"base+arm\"\n[teleoperation.start]\nposition_m = [0.95, 0, 0.35]\n");
  const CommandResult unreachable = youbotd(far, "--virtual-time");
  EXPECT_EQ(unreachable.exit_code, 2);
  EXPECT_TRUE(unreachable.said("the arm cannot reach the start at (0.95")) << unreachable.output;
  const fs::path wrong =
      directory.write("wrong.toml", "[teleoperation.mapping]\nleash_m = -1\nscale = 2\n[scene]\nfloor = 1\n");
  const CommandResult refused = youbotd(wrong, "--virtual-time");
  EXPECT_EQ(refused.exit_code, 2);
  for (const char* line : {"wrong.toml:2: ", "wrong.toml:3: ", "wrong.toml:5: "})
    EXPECT_TRUE(refused.said(line)) << line << refused.output;
}

TEST(TeleopCommand, AStartThatFailsExitsWithFourAndSaysWhyAndWhereEvenWhenQuiet) {
  const support::TemporaryDirectory directory;
  const fs::path config = directory.write(
      "hasty.toml", "[ethercat]\nkind = \"base+arm\"\n[teleoperation.start]\nunfolding_timeout_s = 1\n");
  const CommandResult result =
      youbotd(config, "--virtual-time --quiet --record " + (directory / "run").string());
  EXPECT_EQ(result.exit_code, 4) << result.output;
  EXPECT_TRUE(result.said("the arm did not come to its unfolded pose in time")) << result.output;
  EXPECT_TRUE(result.said((directory / "run").string() + "/youbotd-fault-")) << result.output;
}

TEST(TeleopCommand, OtherProgramsTakeItsFileToo) {
  const support::TemporaryDirectory directory;
  const std::string out = (directory / "out").string();
  for (const std::string& command : {std::string("haptic-hold --virtual-time --duration 1"),
                                     "staircase --quiet --hold 0.02 --out " + out}) {
    const CommandResult result =
        support::run_command(support::program("youbot-bench") + " " + command + " --config " + kTeleop);
    EXPECT_EQ(result.exit_code, 0) << command << "\n" << result.output;
  }
  EXPECT_TRUE(fs::exists(out + "/staircase/wheel-1.csv"));
}

}  // namespace teleop_command_test
