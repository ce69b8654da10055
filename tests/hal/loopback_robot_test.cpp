// hal::Robot over a plant: when drives get power, and what is reported to the application.
#include "hal/loopback_robot.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <cstdint>
#include <limits>
#include <memory>
#include <set>
#include <span>
#include <string>
#include <vector>

#include "hal/clock.h"
#include "hal/setup_error.h"
#include "hal/youbot_axes.h"
#include "sim/base.h"
#include "tests/support/no_alloc_guard.h"
#include "tests/support/watched_robot.h"

namespace loopback_robot_test {

using namespace std::chrono_literals;
using hal::CommandMode;
using hal::CycleStatus;
using hal::Fault;
using hal::JointCommand;
using hal::JointFault;
using hal::LoopbackRobot;
using hal::RobotCommand;
using hal::RobotSample;

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
constexpr double kInfinity = std::numeric_limits<double>::infinity();

/// Records what reaches it; its joints do what velocity commands say, without delay.
class FakePlant final : public hal::Plant {
 public:
  explicit FakePlant(int joints) : state(static_cast<std::size_t>(joints)) {}

  int joint_count() const noexcept override { return static_cast<int>(state.size()); }
  void measure(std::span<hal::JointSample> samples) noexcept override {
    EXPECT_EQ(samples.size(), state.size());
    std::copy(state.begin(), state.end(), samples.begin());
  }
  void advance(std::span<const JointCommand> commands, bool is_powered,
               std::chrono::nanoseconds duration) noexcept override {
    EXPECT_EQ(commands.size(), state.size());
    last_commands.assign(commands.begin(), commands.end());
    powered = is_powered;
    time += duration;
    ++advances;
    if (!powered) return;
    for (std::size_t i = 0; i < state.size(); ++i)
      if (commands[i].mode == CommandMode::kVelocity)
        state[i].position_rad += commands[i].target * std::chrono::duration<double>(duration).count();
  }
  bool received_power_or_torque() const {
    return powered ||
           std::any_of(last_commands.begin(), last_commands.end(), [](const JointCommand& command) {
             return command.mode != CommandMode::kTorque || command.target != 0.0;
           });
  }

  std::vector<hal::JointSample> state;
  std::vector<JointCommand> last_commands;
  bool powered = false;
  std::chrono::nanoseconds time{};
  int advances = 0;
};

std::vector<hal::JointInfo> names(std::size_t count) {
  std::vector<hal::JointInfo> joints;
  for (std::size_t i = 0; i < count; ++i) joints.push_back({"joint-" + std::to_string(i + 1), 2.0});
  return joints;
}

RobotCommand enabled() {
  RobotCommand command;
  command.enable = true;
  return command;
}

class LoopbackRobotTest : public testing::Test {
 protected:
  CycleStatus exchange(const RobotCommand& command) { return robot.exchange(command, sample); }
  /// Active, enabled and obeying.
  void start() {
    robot.activate();
    ASSERT_TRUE(exchange(enabled()).ok());
    ASSERT_TRUE(sample.enabled);
    ASSERT_TRUE(plant.powered);
  }

  FakePlant plant{4};
  hal::VirtualClock clock;
  support::WatchedLoopback robot{plant, clock, 1ms, names(4)};
  RobotSample sample;
};

TEST_F(LoopbackRobotTest, DoesNothingBeforeActivateAndLeavesTheSampleAlone) {
  sample.stamp = 42ns;
  sample.joints[0].position_rad = 7;
  const CycleStatus status = exchange(enabled());
  EXPECT_EQ(status.fault, Fault::kNotActive);
  EXPECT_EQ(status.joint, -1);
  EXPECT_EQ(sample.stamp, 42ns);
  EXPECT_EQ(sample.joints[0].position_rad, 7);
  EXPECT_EQ(plant.advances, 0);
}

TEST_F(LoopbackRobotTest, DoesNothingAfterDeactivate) {
  start();
  robot.deactivate();
  const int advances = plant.advances;
  EXPECT_EQ(exchange(enabled()).fault, Fault::kNotActive);
  EXPECT_EQ(plant.advances, advances);
  robot.deactivate();  // allowed in any state
}

TEST_F(LoopbackRobotTest, NamesItsJointsInOrder) {
  ASSERT_EQ(robot.joints().size(), 4u);
  EXPECT_EQ(robot.joints()[2].name, "joint-3");
  EXPECT_EQ(robot.joints()[2].torque_limit_Nm, 2.0);
}

TEST_F(LoopbackRobotTest, RefusesNamesThatDoNotFitThePlantAndSaysBothCounts) {
  try {
    const LoopbackRobot bad(plant, clock, 1ms, names(3));
    FAIL() << "accepted 3 names for 4 joints";
  } catch (const hal::SetupError& error) {
    const std::string message = error.what();
    EXPECT_NE(message.find("3 names"), std::string::npos) << message;
    EXPECT_NE(message.find("4 joints"), std::string::npos) << message;
  }
  EXPECT_THROW(LoopbackRobot(plant, clock, 1ms, names(5)), hal::SetupError);
}

TEST_F(LoopbackRobotTest, RefusesMoreJointsThanTheLargestYoubotHas) {
  FakePlant largest(hal::kMaxJoints);
  FakePlant larger(hal::kMaxJoints + 1);
  EXPECT_NO_THROW(LoopbackRobot(largest, clock, 1ms, names(hal::kMaxJoints)));
  EXPECT_THROW(LoopbackRobot(larger, clock, 1ms, names(hal::kMaxJoints + 1)), hal::SetupError);
}

TEST_F(LoopbackRobotTest, RefusesAPeriodThatIsNotPositive) {
  EXPECT_THROW(LoopbackRobot(plant, clock, 0ns, names(4)), hal::SetupError);
  EXPECT_THROW(LoopbackRobot(plant, clock, -1ms, names(4)), hal::SetupError);
}

TEST_F(LoopbackRobotTest, CommandsOfEveryModeReachTheirJoint) {
  start();
  RobotCommand command = enabled();
  command.joints[0] = JointCommand::torque_Nm(0.25);
  command.joints[1] = JointCommand::velocity_rad_per_s(-1.5);
  command.joints[2] = JointCommand::position_rad(3.0);
  ASSERT_TRUE(exchange(command).ok());
  ASSERT_EQ(plant.last_commands.size(), 4u);
  EXPECT_EQ(plant.last_commands[0].mode, CommandMode::kTorque);
  EXPECT_EQ(plant.last_commands[0].target, 0.25);
  EXPECT_EQ(plant.last_commands[1].mode, CommandMode::kVelocity);
  EXPECT_EQ(plant.last_commands[1].target, -1.5);
  EXPECT_EQ(plant.last_commands[2].mode, CommandMode::kPosition);
  EXPECT_EQ(plant.last_commands[2].target, 3.0);
  EXPECT_EQ(plant.last_commands[3].mode, CommandMode::kTorque);
  EXPECT_EQ(plant.last_commands[3].target, 0.0);
}

TEST_F(LoopbackRobotTest, VelocitiesAreCutToTheJointsLimitLikeThoseOfARealRobot) {
  std::vector<hal::JointInfo> limited = names(4);
  limited[1].speed_limit_rad_per_s = 2.0;
  LoopbackRobot slow(plant, clock, 1ms, limited);
  slow.activate();
  EXPECT_EQ(slow.joints()[1].speed_limit_rad_per_s, 2.0);
  for (const double velocity_rad_per_s : {1.5, -1e300}) {
    RobotCommand command = enabled();
    for (std::size_t i = 0; i < 4; ++i)
      command.joints[i] = JointCommand::velocity_rad_per_s(velocity_rad_per_s);
    ASSERT_TRUE(slow.exchange(command, sample).ok());
    EXPECT_EQ(plant.last_commands[1].target, std::max(velocity_rad_per_s, -2.0));
    EXPECT_EQ(plant.last_commands[2].target, velocity_rad_per_s) << "without a limit";
  }
}

TEST_F(LoopbackRobotTest, TheSampleAnswersThePreviousCommand) {
  start();
  RobotCommand command = enabled();
  command.joints[1] = JointCommand::velocity_rad_per_s(2.0);
  ASSERT_TRUE(exchange(command).ok());
  EXPECT_EQ(sample.joints[1].position_rad, 0.0);  // read before the command acted
  command.joints[1] = JointCommand::velocity_rad_per_s(0.0);
  ASSERT_TRUE(exchange(command).ok());
  EXPECT_DOUBLE_EQ(sample.joints[1].position_rad, 2.0 * 1e-3);
}

TEST_F(LoopbackRobotTest, PlantTimeAdvancesByOnePeriodPerCycleWhateverTheState) {
  robot.activate();
  for (int cycle = 1; cycle <= 30; ++cycle) {
    RobotCommand command;
    command.enable = cycle > 10;
    command.joints[0].target = cycle > 20 ? kNaN : 0.0;
    clock.sleep_until(cycle * 1ms);
    static_cast<void>(exchange(command));
    EXPECT_EQ(plant.time, cycle * 1ms);
    EXPECT_EQ(plant.advances, cycle);
  }
}

TEST_F(LoopbackRobotTest, PlantTimeFollowsAClockThatSkipsInWholePeriods) {
  robot.activate();
  struct Wake {
    std::chrono::nanoseconds clock, plant;
  };
  // Each exchange lets the time up to the next one pass; the first has no past.
  for (const Wake& wake : {Wake{7ms, 1ms}, Wake{8ms, 2ms}, Wake{11ms, 5ms}, Wake{12ms, 6ms},
                           Wake{13'400us, 7ms},     // late by jitter: one period
                           Wake{14ms, 8ms},         // and back on the grid
                           Wake{14'100us, 9ms}}) {  // early: still one
    clock.sleep_until(wake.clock);
    ASSERT_TRUE(exchange({}).ok());
    EXPECT_EQ(plant.time, wake.plant) << wake.clock.count();
  }
}

TEST_F(LoopbackRobotTest, ALongStopIsNotSimulated) {
  robot.activate();
  ASSERT_TRUE(exchange({}).ok());
  clock.sleep_until(1h);
  ASSERT_TRUE(exchange({}).ok());
  EXPECT_EQ(plant.time, 1ms + LoopbackRobot::kMaxPeriods * 1ms);
  robot.deactivate();
  clock.sleep_until(2h);
  robot.activate();  // the time between two runs does not count either
  ASSERT_TRUE(exchange({}).ok());
  EXPECT_EQ(plant.time, 1ms + LoopbackRobot::kMaxPeriods * 1ms + 1ms);
}

TEST_F(LoopbackRobotTest, DuringSkippedCyclesTheDrivesObeyTheLastCommandAndTheSampleIsOfItsStamp) {
  robot.activate();
  RobotCommand command = enabled();
  command.joints[0] = JointCommand::velocity_rad_per_s(2.0);
  ASSERT_TRUE(exchange(command).ok());
  clock.sleep_until(1ms);
  ASSERT_TRUE(exchange(command).ok());
  EXPECT_DOUBLE_EQ(sample.joints[0].position_rad, 2.0 * 1e-3);
  clock.sleep_until(4ms);  // two cycles missed: the drives have gone on at 2 rad/s
  command.joints[0] = JointCommand::velocity_rad_per_s(0.0);
  ASSERT_TRUE(exchange(command).ok());
  EXPECT_EQ(sample.stamp, 4ms);
  EXPECT_DOUBLE_EQ(sample.joints[0].position_rad, 2.0 * 4e-3);
  clock.sleep_until(5ms);
  ASSERT_TRUE(exchange(command).ok());
  EXPECT_DOUBLE_EQ(sample.joints[0].position_rad, 2.0 * 4e-3) << "the new command does not reach back";
}

TEST_F(LoopbackRobotTest, TheStampIsTheTimeOfTheExchange) {
  robot.activate();
  clock.sleep_until(17ms);
  ASSERT_TRUE(exchange({}).ok());
  EXPECT_EQ(sample.stamp, 17ms);
}

TEST_F(LoopbackRobotTest, IsUnpoweredUntilEnabledAndMeasuresAllTheSame) {
  robot.activate();
  plant.state[3].position_rad = 0.5;
  RobotCommand command;
  command.joints[0] = JointCommand::torque_Nm(1.0);
  ASSERT_TRUE(exchange(command).ok());
  EXPECT_FALSE(plant.received_power_or_torque());
  EXPECT_FALSE(sample.enabled);
  EXPECT_EQ(sample.joints[3].position_rad, 0.5);
}

TEST_F(LoopbackRobotTest, DisablingTakesThePowerOffInTheSameCycle) {
  start();
  ASSERT_TRUE(exchange({}).ok());
  EXPECT_FALSE(plant.received_power_or_torque());
  EXPECT_FALSE(sample.enabled);
}

TEST_F(LoopbackRobotTest, EveryKindOfBadCommandIsRefusedAndNamed) {
  for (const double bad : {kNaN, kInfinity, -kInfinity}) {
    for (const CommandMode mode : {CommandMode::kTorque, CommandMode::kVelocity, CommandMode::kPosition}) {
      for (std::size_t joint = 0; joint < 4; ++joint) {
        start();
        RobotCommand command = enabled();
        for (std::size_t i = 0; i < 4; ++i) command.joints[i] = JointCommand::torque_Nm(0.1);
        command.joints[joint] = {mode, bad};
        const CycleStatus status = exchange(command);
        EXPECT_EQ(status.fault, Fault::kBadCommand);
        EXPECT_EQ(status.joint, static_cast<int>(joint));
        EXPECT_EQ(status.detail, static_cast<std::uint32_t>(mode));
        // The whole robot is off, its sound joints too.
        EXPECT_FALSE(plant.received_power_or_torque());
        EXPECT_FALSE(sample.enabled);
      }
    }
  }
}

TEST_F(LoopbackRobotTest, TheFirstOfSeveralBadJointsIsNamed) {
  start();
  RobotCommand command = enabled();
  command.joints[3].target = kNaN;
  command.joints[1].target = kNaN;
  EXPECT_EQ(exchange(command).joint, 1);
}

TEST_F(LoopbackRobotTest, EntriesBeyondTheRobotsJointsDoNotMatter) {
  start();
  RobotCommand command = enabled();
  command.joints[4].target = kNaN;
  EXPECT_TRUE(exchange(command).ok());
  EXPECT_TRUE(plant.powered);
}

TEST_F(LoopbackRobotTest, AFaultStaysUntilOneDisabledCycleAndMotionNeedsANewEnable) {
  start();
  RobotCommand bad = enabled();
  bad.joints[2].target = kNaN;
  ASSERT_EQ(exchange(bad).fault, Fault::kBadCommand);

  RobotCommand good = enabled();
  good.joints[2] = JointCommand::velocity_rad_per_s(1.0);
  for (int cycle = 0; cycle < 5; ++cycle) {  // well-meant commands do not bring it back
    const CycleStatus status = exchange(good);
    EXPECT_EQ(status.fault, Fault::kBadCommand);
    EXPECT_EQ(status.joint, 2);
    EXPECT_FALSE(plant.received_power_or_torque());
    EXPECT_FALSE(sample.enabled);
  }

  EXPECT_TRUE(exchange({}).ok());  // acknowledged ...
  EXPECT_FALSE(plant.received_power_or_torque());
  EXPECT_FALSE(sample.enabled);
  EXPECT_EQ(sample.joints[2].position_rad, 0.0);

  EXPECT_TRUE(exchange(good).ok());  // ... and only now started again
  EXPECT_TRUE(plant.powered);
  EXPECT_TRUE(sample.enabled);
}

TEST_F(LoopbackRobotTest, ALaterFaultDoesNotHideTheFirst) {
  start();
  RobotCommand bad = enabled();
  bad.joints[2].target = kNaN;
  ASSERT_EQ(exchange(bad).joint, 2);
  bad.joints[0].target = kNaN;
  plant.state[1].position_rad = kNaN;
  const CycleStatus status = exchange(bad);
  EXPECT_EQ(status.fault, Fault::kBadCommand);
  EXPECT_EQ(status.joint, 2);
}

TEST_F(LoopbackRobotTest, ABadCommandWhileDisabledIsReportedToo) {
  robot.activate();
  RobotCommand bad;
  bad.joints[0].target = kNaN;
  EXPECT_EQ(exchange(bad).fault, Fault::kBadCommand);
  EXPECT_EQ(exchange(enabled()).fault, Fault::kBadCommand) << "latched: not yet disabled with a good command";
  EXPECT_TRUE(exchange({}).ok());
}

TEST_F(LoopbackRobotTest, AMeasurementThatIsNotANumberIsAJointFault) {
  for (const double bad : {kNaN, kInfinity}) {
    for (double hal::JointSample::*const quantity :
         {&hal::JointSample::position_rad, &hal::JointSample::velocity_rad_per_s,
          &hal::JointSample::torque_Nm}) {
      start();
      plant.state[3].*quantity = bad;
      const CycleStatus status = exchange(enabled());
      EXPECT_EQ(status.fault, Fault::kJointFault);
      EXPECT_EQ(status.joint, 3);
      EXPECT_EQ(status.detail, static_cast<std::uint32_t>(JointFault::kBadSample));
      EXPECT_FALSE(plant.received_power_or_torque());
      EXPECT_FALSE(sample.enabled);
      plant.state[3] = {};
    }
  }
}

TEST_F(LoopbackRobotTest, AFaultOfAMotorControllerIsPassedOnAndTakesThePowerOff) {
  start();
  plant.state[1].fault = JointFault::kI2t;
  CycleStatus status = exchange(enabled());
  EXPECT_EQ(status.fault, Fault::kJointFault);
  EXPECT_EQ(status.joint, 1);
  EXPECT_EQ(status.detail, static_cast<std::uint32_t>(JointFault::kI2t));
  EXPECT_FALSE(plant.received_power_or_torque());

  plant.state[1].fault = JointFault::kNone;  // gone by itself, still latched
  EXPECT_EQ(exchange(enabled()).fault, Fault::kJointFault);
  EXPECT_FALSE(plant.received_power_or_torque());
}

TEST_F(LoopbackRobotTest, DisablingDoesNotHideAFaultThatIsStillThere) {
  start();
  plant.state[1].fault = JointFault::kHallSensor;
  ASSERT_FALSE(exchange(enabled()).ok());
  EXPECT_EQ(exchange({}).detail, static_cast<std::uint32_t>(JointFault::kHallSensor));
  EXPECT_EQ(exchange(enabled()).fault, Fault::kJointFault);
  EXPECT_FALSE(plant.received_power_or_torque());
}

TEST_F(LoopbackRobotTest, ActivatingAgainStartsDisabledAndWithoutOldFaults) {
  start();
  RobotCommand bad = enabled();
  bad.joints[0].target = kNaN;
  ASSERT_FALSE(exchange(bad).ok());
  robot.deactivate();
  robot.activate();
  EXPECT_TRUE(exchange({}).ok());
  EXPECT_FALSE(sample.enabled);
}

TEST(Fault, EveryFaultHasWordsOfItsOwn) {
  std::set<std::string> words;
  constexpr std::array kFaults{Fault::kNone,           Fault::kNotActive, Fault::kBadCommand,
                               Fault::kJointFault,     Fault::kFrameLost, Fault::kPartialBus,
                               Fault::kSimulatorSilent};
  for (const Fault fault : kFaults) words.insert(hal::describe(fault));
  EXPECT_EQ(words.size(), kFaults.size());
  EXPECT_FALSE(words.contains("unknown fault"));

  words.clear();
  constexpr std::array kJointFaults{JointFault::kNone,           JointFault::kUndervoltage,
                                    JointFault::kOvervoltage,    JointFault::kOvertemperature,
                                    JointFault::kHallSensor,     JointFault::kEncoder,
                                    JointFault::kCommandTimeout, JointFault::kI2t,
                                    JointFault::kBadSample};
  for (const JointFault fault : kJointFaults) words.insert(hal::describe(fault));
  EXPECT_EQ(words.size(), kJointFaults.size());
  EXPECT_FALSE(words.contains("unknown joint fault"));
}

/// The same robot over the simulated base with its wheels in the air.
class LoopbackRobotOnSimulatedBase : public testing::Test {
 protected:
  LoopbackRobotOnSimulatedBase() { robot.activate(); }
  void run(const RobotCommand& command, int cycles) {
    for (int i = 0; i < cycles; ++i) ASSERT_TRUE(robot.exchange(command, sample).ok());
  }

  static sim::BaseParameters in_the_air() {
    sim::BaseParameters parameters;
    parameters.on_ground = false;
    return parameters;
  }
  sim::Base base{in_the_air()};
  hal::VirtualClock clock;
  support::WatchedLoopback robot{base, clock, 1ms, names(4)};
  RobotSample sample;
};

TEST_F(LoopbackRobotOnSimulatedBase, AVelocityCommandIsReachedAsFastAsTheCurrentLimitAllowsAndHeld) {
  RobotCommand command = enabled();
  command.joints[1] = JointCommand::velocity_rad_per_s(3.0);
  // 2.85 A x 0.0335 N·m/A x 25.84 against the inertia: no velocity beyond that acceleration times time.
  const double fastest_rad_per_s2 = 2.85 * 0.0335 * (9405.0 / 364.0) / base.wheel(1).inertia_kg_m2();
  for (int cycle = 1; cycle <= 2000; ++cycle) {
    run(command, 1);
    ASSERT_LE(base.wheel(1).velocity_rad_per_s(), fastest_rad_per_s2 * cycle * 1e-3);
  }
  const double before_rad = base.wheel(1).position_rad();
  run(command, 1000);
  // Over one second the controller's integral makes the mean of the measured velocity, one tick difference
  // per period, equal the target: the rest is velocity noise, 0.03/sqrt(1000), and its dead-beat residue.
  EXPECT_NEAR(base.wheel(1).position_rad() - before_rad, 3.0, 0.01);
  EXPECT_EQ(base.wheel(0).position_rad(), 0.0);
}

TEST_F(LoopbackRobotOnSimulatedBase, APositionCommandIsReached) {
  RobotCommand command = enabled();
  command.joints[2] = JointCommand::position_rad(-1.0);
  run(command, 5000);
  // Dry friction and velocity noise leave a hunt of a few milliradian around the target.
  EXPECT_NEAR(base.wheel(2).position_rad(), -1.0, 0.02);
}

TEST_F(LoopbackRobotOnSimulatedBase, ATorqueCommandIsDeliveredAndShownByTheCurrent) {
  RobotCommand command = enabled();
  command.joints[0] = JointCommand::torque_Nm(0.03);  // below break-away: the wheel holds
  run(command, 3000);                                 // the stuck wheel's ringing fades with e^-6 per second
  double mean_Nm = 0;
  for (int i = 0; i < 500; ++i) {
    run(command, 1);
    mean_Nm += sample.joints[0].torque_Nm / 500;
  }
  // Noise 0.0015/sqrt(500) = 7e-5, counts of 1 mA = 8.7e-4 dithered by that noise: four sigma.
  EXPECT_NEAR(mean_Nm, 0.03, 3e-4);
  EXPECT_NEAR(base.wheel(0).motor_torque_Nm(), 0.03, 1e-9);  // ringing and current loop long settled
}

TEST_F(LoopbackRobotOnSimulatedBase, LosesItsTorqueWithinTheCycleOfABadCommand) {
  RobotCommand command = enabled();
  for (std::size_t i = 0; i < 4; ++i) command.joints[i] = JointCommand::torque_Nm(0.5);
  run(command, 100);
  ASSERT_GT(base.wheel(3).motor_torque_Nm(), 0.1);
  command.joints[0].target = kNaN;
  EXPECT_FALSE(robot.exchange(command, sample).ok());
  for (int i = 0; i < 4; ++i) EXPECT_EQ(base.wheel(i).motor_torque_Nm(), 0.0) << "wheel " << i + 1;
}

TEST_F(LoopbackRobotOnSimulatedBase, ExchangeDoesNotAllocateOrLock) {
  if (!support::NoAllocGuard::kActive) GTEST_SKIP() << "the sanitizer owns malloc";
  sim::Base grounded{sim::BaseParameters{}};
  LoopbackRobot other(grounded, clock, 1ms, names(4));
  other.activate();
  RobotCommand command = enabled();
  command.joints[0] = JointCommand::torque_Nm(0.2);
  command.joints[1] = JointCommand::velocity_rad_per_s(1.0);
  command.joints[2] = JointCommand::position_rad(1.0);
  RobotCommand bad = command;
  bad.joints[3].target = kNaN;

  bool ok = true;
  const support::NoAllocGuard guard;
  for (int i = 0; i < 10; ++i)
    ok = robot.exchange(command, sample).ok() && other.exchange(command, sample).ok() && ok;
  ok = !robot.exchange(bad, sample).ok() && ok;
  ok = robot.exchange({}, sample).ok() && ok;
  const long violations = guard.violations();
  EXPECT_EQ(violations, 0);
  EXPECT_TRUE(ok);
}

}  // namespace loopback_robot_test
