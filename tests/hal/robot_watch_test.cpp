// The invariant checks of tests with a robot: each of the rules detects a robot that breaks it.
#include "tests/support/robot_watch.h"

#include <gtest/gtest-spi.h>
#include <gtest/gtest.h>

#include <array>
#include <cstdint>
#include <functional>
#include <limits>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "drivers/tmcl/axis_parameters.h"
#include "drivers/tmcl/process_data.h"
#include "sim/base.h"
#include "tests/hal/can_bench.h"
#include "tests/hal/ethercat_rig.h"

namespace hal::test {
namespace robot_watch_test {

using drivers::tmcl::ControllerMode;

/// Between the calls of a test and the true robot.
struct Defect {
  std::function<void(RobotCommand&)> on_command = [](RobotCommand&) {};
  std::function<void(CycleStatus&)> on_status = [](CycleStatus&) {};
  std::function<void()> after_frame = [] {};
};

class DefectiveRobot final : public Robot {
 public:
  DefectiveRobot(std::unique_ptr<Robot> robot, Defect& defect) : robot_(std::move(robot)), defect_(defect) {}
  std::span<const JointInfo> joints() const noexcept override { return robot_->joints(); }
  void activate() override { robot_->activate(); }
  void deactivate() noexcept override { robot_->deactivate(); }
  CycleStatus exchange(const RobotCommand& command, RobotSample& sample) noexcept override {
    RobotCommand spoiled = command;
    defect_.on_command(spoiled);
    CycleStatus status = robot_->exchange(spoiled, sample);
    defect_.on_status(status);
    defect_.after_frame();
    return status;
  }

 private:
  std::unique_ptr<Robot> robot_;
  Defect& defect_;
};

/// All wheels turn, in the air.
class RobotWatch : public ::testing::Test {
 protected:
  void SetUp() override {
    rig.robot->activate();
    rig.enable();
    rig.command_all_velocity(1.0);
    rig.run(300ms);
    ASSERT_TRUE(rig.status.ok());
    ASSERT_EQ(rig.watch.violations(), std::vector<std::string>{});
  }
  /// What board 1 has in its mailbox or its process data, whatever the master sends.
  void write(ControllerMode mode, std::int32_t value) {
    std::array<std::uint8_t, drivers::tmcl::kOutputBytes> bytes{};
    ASSERT_TRUE(drivers::tmcl::pack({mode, value}, bytes));
    rig.emulation.board(0).outputs_changed(bytes);
  }

  Defect defect;
  EthercatRig rig{EthercatRig::options(YoubotKind::kBase),
                  {.kind = YoubotKind::kBase},
                  [this](std::unique_ptr<Robot> robot) -> std::unique_ptr<Robot> {
                    return std::make_unique<DefectiveRobot>(std::move(robot), defect);
                  }};
};

TEST_F(RobotWatch, CatchesADisableThatIsNotPassedOn) {
  rig.watch.expect_violation("wheel-1 is commanded without an enable");
  rig.watch.expect_violation("wheel-4 is commanded without an enable");
  for (std::size_t wheel : {1, 2}) rig.command.joints[wheel] = JointCommand::velocity_rad_per_s(0.0);
  rig.run(10ms);
  defect.on_command = [](RobotCommand& command) { command.enable = true; };
  rig.command.enable = false;
  rig.run(10ms);
  EXPECT_EQ(rig.watch.violations().size(), 2U) << "those that stand do nothing";
}

TEST_F(RobotWatch, CatchesARobotThatGoesOnAfterTheFaultItReported) {
  rig.watch.expect_violation("is commanded without an enable");
  defect.on_status = [](CycleStatus& status) { status = {Fault::kFrameLost}; };
  rig.run(10ms);
}

TEST_F(RobotWatch, CatchesARobotThatEnablesItselfAfterAFault) {
  rig.watch.expect_violation("is commanded without an enable");
  int cycle = 0;
  defect.on_command = [&cycle](RobotCommand& command) { command.enable = ++cycle < 10 || cycle > 30; };
  rig.emulation.slave(1).set_fault(sim::bus::BoardFault::kHallSensor, true);
  rig.run(20ms);
  rig.emulation.slave(1).set_fault(sim::bus::BoardFault::kHallSensor, false);
  rig.run(1s);
}

TEST_F(RobotWatch, CatchesDrivesThatAreSwitchedOffAndOnAgainInOneRun) {
  rig.watch.expect_violation("is commanded again in a run that stopped it");
  for (const bool off : {true, false}) {
    defect.on_command = [off](RobotCommand& command) { command.enable = !off; };
    defect.on_status = [](CycleStatus& status) { status = {}; };
    rig.run(500ms);
  }
}

TEST_F(RobotWatch, CatchesABoardWhoseWatchdogIsTooLong) {
  rig.watch.expect_violation("wheel-1 is commanded later than 105 ms after the last process data");
  rig.watch.expect_violation("wheel-1 is commanded without an enable");
  using drivers::tmcl::drive_parameter;
  sim::bus::TmcmBoard& board = rig.emulation.board(0);
  (void)board.execute(drivers::tmcl::set(drive_parameter("approve_protected_parameters"), 4711));
  (void)board.execute(drivers::tmcl::set(drive_parameter("motor_controller_timeout"), 1000));
  ASSERT_EQ(board.parameters()[90], 1000);
  rig.emulation.bus().set_cable(0, false);
  rig.run(300ms);
}

TEST_F(RobotWatch, CatchesTorqueAboveTheMotorsLimit) {
  rig.watch.expect_violation("wheel-1 is commanded 2.5");
  defect.after_frame = [this] { write(ControllerMode::kCurrent, 2900); };  // mA, of 2850
  rig.run(3ms);
}

TEST_F(RobotWatch, CatchesASpeedAboveTheLimit) {
  rig.watch.expect_violation("wheel-1 is commanded 16.4");
  defect.after_frame = [this] { write(ControllerMode::kVelocity, 4050); };  // rpm of the motor, of 4000
  rig.run(3ms);
}

TEST_F(RobotWatch, CatchesWhatIsWrittenToABoardBehindTheRobot) {
  rig.watch.expect_violation("wheel-1 is commanded without an enable");
  rig.command.enable = false;
  rig.run(200ms);
  EXPECT_EQ(rig.watch.violations(), std::vector<std::string>{});
  write(ControllerMode::kCurrent, 1);
  rig.emulation.advance(1ms);
}

TEST_F(RobotWatch, CatchesAnEnableTooMany) {
  rig.watch.expect_violation("the robot is enabled by itself");
  rig.watch.allow_enables(1);
  for (const bool enable : {false, true, false, true}) {
    rig.command.enable = enable;
    rig.run(10ms);
  }
  EXPECT_EQ(rig.watch.violations().size(), 1U);
}

TEST(RobotWatchOfAnArm, CatchesAPositionOutOfAHomedJointsRange) {
  EthercatRig rig(EthercatRig::options(YoubotKind::kArm), {.kind = YoubotKind::kArm, .home_arms = true});
  rig.robot->activate();
  rig.command.enable = true;
  rig.run_until([&] { return rig.sample.enabled; }, 60s);
  ASSERT_TRUE(rig.sample.enabled);
  for (std::size_t i = 0; i < 5; ++i) rig.command.joints[i] = JointCommand::position_rad(i == 2 ? -2.0 : 2.0);
  rig.run(1s);
  ASSERT_EQ(rig.watch.violations(), std::vector<std::string>{});
  rig.watch.expect_violation("arm-2 is commanded 2.8");
  rig.watch.expect_violation("arm-3 is commanded -5.");
  rig.command.joints[1] = JointCommand::position_rad(2.8);
  rig.command.joints[2] = JointCommand::position_rad(-5.3);
  rig.run(2ms);
}

TEST(RobotWatchOfACanRig, CatchesADisableThatDoesNotReachTheModule) {
  CanBench bench;
  bench.robot->activate();
  bench.enable();
  bench.command.joints[0] = JointCommand::velocity_rad_per_s(1.0);
  bench.run(300ms);
  ASSERT_EQ(bench.watch.violations(), std::vector<std::string>{});
  bench.watch.expect_violation("wheel-1 is commanded without an enable");
  bench.command.enable = false;
  bench.run(100ms);
  ASSERT_EQ(bench.watch.violations(), std::vector<std::string>{});
  // Another program on the bus.
  (void)bench.rig.board().execute(
      {.command = drivers::tmcl::Command::kRotateRight, .type = 0, .motor = 0, .value = 100});
  bench.rig.advance(1ms);
}

TEST(RobotWatchOfALoopback, CatchesTorqueThatItsMotorsDoNotDeliver) {
  VirtualClock clock;
  sim::Base base{sim::BaseParameters{}};
  support::WatchedLoopback robot(base, clock, 1ms,
                                 {{"wheel-1", 2.0}, {"wheel-2", 2.0}, {"wheel-3", 2.0}, {"wheel-4", 2.0}});
  robot.activate();
  RobotCommand command;
  RobotSample sample;
  command.enable = true;
  command.joints[2] = JointCommand::torque_Nm(2.0);
  EXPECT_TRUE(robot.exchange(command, sample).ok());
  EXPECT_EQ(robot.watch.violations(), std::vector<std::string>{});
  robot.watch.expect_violation("wheel-3 is commanded -2.1");
  command.joints[2] = JointCommand::torque_Nm(-2.1);
  EXPECT_TRUE(robot.exchange(command, sample).ok());
}

// What only a loopback robot could be commanded, which takes doubles.
TEST(RobotWatchOfALoopback, CatchesTargetsThatAreNotFinite) {
  constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  using enum support::FollowedDrive::Mode;
  for (const auto mode : {kCurrent, kVelocity, kPosition})
    for (const double target : {kNaN, kInfinity, -kInfinity}) {
      support::RobotWatch watch({{.name = "joint", .torque_Nm = 1.0, .speed_rad_per_s = kInfinity}});
      watch.permit();
      watch.look(1ms, std::array{support::FollowedDrive{.mode = mode, .target = 0.5}});
      EXPECT_EQ(watch.violations().size(), 0U);
      watch.look(2ms, std::array{support::FollowedDrive{.mode = mode, .target = target}});
      EXPECT_EQ(watch.violations().size(), 1U) << target;
    }
}

TEST(TestWatch, FailsAtItsEndForAViolationAndForOneThatDoesNotCome) {
  const auto turn = [](bool expects) {
    support::TestWatch watch({{.name = "joint", .torque_Nm = 1.0, .speed_rad_per_s = 1.0}});
    if (expects) watch.expect_violation("no such thing");
    watch.look(10ms, std::array{support::FollowedDrive{.mode = support::FollowedDrive::Mode::kPosition}});
  };
  EXPECT_NONFATAL_FAILURE(turn(false), "at 10 ms: joint is commanded without an enable");
  ::testing::TestPartResultArray failures;
  {
    const ::testing::ScopedFakeTestPartResultReporter reporter(
        ::testing::ScopedFakeTestPartResultReporter::INTERCEPT_ONLY_CURRENT_THREAD, &failures);
    turn(true);
  }
  ASSERT_EQ(failures.size(), 2);
  EXPECT_NE(std::string(failures.GetTestPartResult(1).message()).find("no violation: no such thing"),
            std::string::npos);
}

}  // namespace robot_watch_test
}  // namespace hal::test
