#include "runtime/open_robot.h"

#include <gtest/gtest-spi.h>
#include <gtest/gtest.h>

#include <array>
#include <atomic>
#include <filesystem>
#include <stdexcept>
#include <string>

#include "drivers/tmcl/process_data.h"
#include "operation/config.h"
#include "operation/session.h"
#include "runtime/wire_robot.h"
#include "tests/support/built_paths.h"
#include "tests/support/watched_open_robot.h"

namespace runtime {
namespace open_robot_test {

using namespace std::chrono_literals;

std::string refusal_of(const std::string& name) {
  const hal::VirtualClock clock;
  RobotOptions options;
  options.name = name;
  try {
    (void)open_robot(options, clock, 1ms);
  } catch (const std::invalid_argument& error) {
    return error.what();
  }
  return "";
}

TEST(OpenRobot, ABenchRigHasOneJointAndLivesInRealTime) {
  const hal::VirtualClock clock;
  RobotOptions options;
  options.name = "can:can0";
  options.can.joint_name = "wheel-3";
  const OpenedRobot opened = open_robot(options, clock, 1ms);
  ASSERT_EQ(opened.robot->joints().size(), 1U);
  EXPECT_EQ(opened.robot->joints()[0].name, "wheel-3");
  EXPECT_EQ(opened.truth, nullptr);
  EXPECT_FALSE(is_simulated("can:can0"));
  EXPECT_FALSE(is_simulated("ethercat:eth0"));
  EXPECT_TRUE(is_simulated("loopback"));
}

TEST(OpenRobot, ARobotFileOfTheSimulatedArmNeedsASimulatedArm) {
  RobotOptions options;
  options.arm.emplace();
  for (const char* name : {"loopback", "wire"}) {
    options.name = name;
    EXPECT_NO_THROW(check_robot(options));
  }
  options.name = "ethercat:eth0";
  const hal::VirtualClock clock;
  try {
    (void)open_robot(options, clock, 1ms);
    FAIL();
  } catch (const std::invalid_argument& error) {
    EXPECT_STREQ(error.what(),
                 "'simulation.robot_file' is for the robots loopback and wire, and the robot is "
                 "'ethercat:eth0': remove the key, or choose another robot; youbot-sim takes the file by "
                 "--robot-file");
  }
}

TEST(OpenRobot, ANameWithoutItsInterfaceIsRefusedWithWhatIsMissing) {
  for (const char* name : {"ethercat:", "can:"}) {
    try {
      check_robot_name(name);
      FAIL() << name;
    } catch (const std::invalid_argument& error) {
      EXPECT_NE(std::string(error.what()).find("lacks its network interface"), std::string::npos);
    }
  }
}

TEST(OpenRobot, InLockStepNoOtherPeriodWillDo) {
  const hal::VirtualClock clock;
  RobotOptions options;
  options.name = "ethercat:eth0";
  EXPECT_THROW((void)open_robot(options, clock, 2ms), std::invalid_argument);
}

TEST(OpenRobot, ARobotOnTheEmulatedBusReportsWhatItsMasterFound) {
  hal::VirtualClock clock;
  sim::bus::YoubotBusOptions options;
  // Bring-up takes some hundred frames; a cycle each afterwards.
  options.wire.faults = {
      {.kind = sim::bus::FaultKind::kDamageOnCable, .at_frame = 1000, .count = 3, .slave = 1}};
  sim::bus::YoubotBus emulation(options);
  WireRobot robot(emulation, {.kind = hal::YoubotKind::kBase}, clock, 1ms);
  EXPECT_TRUE(robot.report().empty());
  robot.activate();
  const hal::RobotCommand at_rest;
  hal::RobotSample sample;
  for (int cycle = 0; cycle < 3000; ++cycle) {
    (void)robot.exchange(at_rest, sample);
    clock.sleep_until(clock.now() + 1ms);
  }
  std::string reported;
  for (const std::string& line : robot.report()) reported += line + "\n";
  EXPECT_NE(reported.find("slave 2 (TMCM-1632) port 0: 3 new CRC errors: check the cable from slave 1"),
            std::string::npos)
      << reported;
  robot.deactivate();
  EXPECT_TRUE(robot.report().empty());
}

TEST(OpenRobot, ABaseWithAnArmStandsInTheSceneAlsoBehindTheEmulatedBus) {
  const hal::VirtualClock clock;
  RobotOptions options;
  options.ethercat.kind = hal::YoubotKind::kBaseAndArm;
  options.scene.box = sim::FreeBox{.block = {.centre_W_m = {0.5, 0.1, 0.05}, .size_m = {0.1, 0.1, 0.1}}};
  for (const char* name : {"loopback", "wire"}) {
    options.name = name;
    const OpenedRobot opened = open_robot(options, clock, 1ms);
    EXPECT_EQ(opened.robot->joints().size(), 9U) << name;
    ASSERT_TRUE(opened.manipulator) << name;
    EXPECT_EQ(opened.manipulator->environment().box_p_W_m(), options.scene.box->block.centre_W_m) << name;
  }
  for (const auto kind : {hal::YoubotKind::kBase, hal::YoubotKind::kBaseAndTwoArms}) {
    options.ethercat.kind = kind;
    EXPECT_FALSE(open_robot(options, clock, 1ms).manipulator);
  }
}

/// Violations that the checks of the robots opened in the meantime report.
template <typename Function>
std::string failures_of(Function&& run) {
  testing::TestPartResultArray failures;
  {
    const testing::ScopedFakeTestPartResultReporter reporter(
        testing::ScopedFakeTestPartResultReporter::INTERCEPT_ONLY_CURRENT_THREAD, &failures);
    run();
  }
  std::string text;
  for (int i = 0; i < failures.size(); ++i) text += failures.GetTestPartResult(i).message();
  return text;
}

TEST(OpenRobot, IsWatchedInEveryTest) {
  const auto drives = [](const char* name, double torque_Nm, bool behind_the_robot) {
    hal::VirtualClock clock;
    RobotOptions options;
    options.name = name;
    const OpenedRobot opened = open_robot(options, clock, 1ms);
    hal::RobotCommand command;
    hal::RobotSample sample;
    opened.robot->activate();
    command.enable = true;
    command.joints[0] = hal::JointCommand::torque_Nm(torque_Nm);
    for (int cycle = 0; cycle < 3000; ++cycle) {
      clock.sleep_until(clock.now() + 1ms);
      EXPECT_TRUE(opened.robot->exchange(command, sample).ok());
    }
    EXPECT_TRUE(sample.enabled);
    command.enable = false;
    for (int cycle = 0; cycle < 10; ++cycle) (void)opened.robot->exchange(command, sample);
    if (!behind_the_robot) return;
    std::array<std::uint8_t, drivers::tmcl::kOutputBytes> bytes{};
    EXPECT_TRUE(drivers::tmcl::pack({drivers::tmcl::ControllerMode::kCurrent, 100}, bytes));
    opened.emulation->board(0).outputs_changed(bytes);
    opened.emulation->advance(5ms);
  };
  EXPECT_EQ(failures_of([&] { drives("loopback", 0.1, false); }), "");
  EXPECT_EQ(failures_of([&] { drives("wire", 0.1, false); }), "");
  const std::string too_strong = failures_of([&] { drives("loopback", 10, false); });
  EXPECT_NE(too_strong.find("wheel-1 is commanded 10.0"), std::string::npos) << too_strong;
  const std::string by_itself = failures_of([&] { drives("wire", 0.1, true); });
  EXPECT_NE(by_itself.find("wheel-1 is commanded without an enable"), std::string::npos) << by_itself;
}

TEST(OpenRobot, IsWatchedInASessionThatOpensItsOwn) {
  const operation::Config config = operation::load_config(support::source_dir() + "/apps/youbotd/demo.toml");
  operation::SessionOptions options;
  options.virtual_time = true;
  options.duration = 100ms;
  const std::atomic<bool> stop{false};
  const int before = support::watched_robots_opened();
  (void)operation::run_session(config, options, stop);
  EXPECT_EQ(support::watched_robots_opened(), before + 1);
}

TEST(OpenRobot, AnUnknownNameIsAnsweredWithAllThatExist) {
  for (const char* name : {"toaster", "can"}) {
    const std::string text = refusal_of(name);
    for (const char* known : {"loopback", "wire", "ethercat:IFACE", "can:IFACE"})
      EXPECT_NE(text.find(known), std::string::npos) << name << ": " << text;
  }
}

TEST(OpenRobot, TheBasesPathIsNotDrivenOnOneJoint) {
  operation::Config config = operation::load_config(support::source_dir() + "/apps/youbotd/demo.toml");
  config.robot.name = "can:can0";
  const std::atomic<bool> stop{false};
  try {
    (void)operation::run_session(config, {}, stop);
    FAIL() << "ran";
  } catch (const std::invalid_argument& error) {
    EXPECT_STREQ(
        error.what(),
        "the base needs a robot with four wheels, this one has 1 joint, the first of which is wheel-1");
  }
}

}  // namespace open_robot_test
}  // namespace runtime
