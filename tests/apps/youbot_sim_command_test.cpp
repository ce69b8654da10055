// The command youbot-sim, as far as it needs no network interface.
#include <gtest/gtest.h>

#include <filesystem>
#include <string>

#include "tests/support/built_paths.h"
#include "tests/support/run_command.h"
#include "tests/support/temporary_directory.h"

namespace youbot_sim_command_test {

using support::CommandResult;

CommandResult simulate(const std::string& arguments) {
  return support::run_command(support::program("youbot-sim") + " --interface nosuchif0 " + arguments);
}

TEST(YoubotSimCommand, RobotsAreCalledAsEverywhereElse) {
  for (const char* robot : {"base", "arm", "base+arm", "base+two-arms"}) {
    const CommandResult result = simulate(std::string("--robot ") + robot);
    EXPECT_EQ(result.exit_code, 3) << "only the interface is missing: " << result.output;
    EXPECT_TRUE(result.said("nosuchif0")) << result.output;
  }
  const CommandResult unknown = simulate("--robot toaster");
  EXPECT_EQ(unknown.exit_code, 2);
  EXPECT_TRUE(unknown.said("base+two-arms")) << unknown.output;
}

TEST(YoubotSimCommand, AFaultThatCannotBeIsNamedWithItsLine) {
  const support::TemporaryDirectory directory;
  const std::string faults = directory.write("faults.toml",
                                             "[[fault]]\nkind = \"slave_off\"\nslave = 6\n"
                                             "[[fault]]\nkind = \"delay\"\n");
  const CommandResult base = simulate("--robot base --faults " + faults);
  EXPECT_EQ(base.exit_code, 2);
  EXPECT_TRUE(base.said(faults + ":3: 'fault[0].slave' is 6, allowed is 1 to 5")) << base.output;
  EXPECT_TRUE(base.said(faults + ":4: 'fault[1].delay_s' is zero or missing: the kind delay needs one"))
      << base.output;
  const CommandResult arm = simulate("--robot arm --faults " + faults);
  EXPECT_FALSE(arm.said("faults.toml:3")) << arm.output;
}

// simulated_arm_over_veth_test.cpp tests that the arm follows its file.
TEST(YoubotSimCommand, ARobotFileThatCannotBeUsedIsRefused) {
  const std::string shipped = support::source_dir() + "/control/youbot_arm.toml";
  const support::TemporaryDirectory directory;
  const std::string bad = directory.write("bad.toml", "format = \"youbot-robot-model/1\"\nmass = 1\n");
  const CommandResult refused = simulate("--robot-file " + bad);
  EXPECT_EQ(refused.exit_code, 2) << refused.output;
  EXPECT_TRUE(refused.said(bad + ":2: ")) << refused.output;
  const std::string of_base = support::source_dir() + "/tests/data/diff_drive_base/robot.toml";
  const CommandResult other = simulate("--robot-file " + of_base);
  EXPECT_EQ(other.exit_code, 2);
  EXPECT_TRUE(other.said(of_base + ":4: 'base' makes this the description of a base")) << other.output;
  const CommandResult base = simulate("--robot base --robot-file " + shipped);
  EXPECT_EQ(base.exit_code, 2);
  EXPECT_TRUE(base.said("--robot-file needs --robot base+arm")) << base.output;
}

}  // namespace youbot_sim_command_test
