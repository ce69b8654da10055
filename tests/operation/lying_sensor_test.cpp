// One sensor of the simulated robot is wrong: the run ends and names the joint before anything has moved far.
// Correct sensors on floors, walls and loads of all kinds end no run. In virtual time.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <random>
#include <string>
#include <vector>

#include "runtime/monitored_robot.h"
#include "tests/hal/ethercat_rig.h"
#include "tests/operation/sensor_rigs.h"
#include "tests/support/lying_board.h"

namespace lying_sensor_test {

using namespace std::chrono_literals;
using control::TeleopEnd;
using control::TeleopPhase;
using sensor_rigs::ArmRig;
using sensor_rigs::BaseRig;
using support::Channel;
using support::SensorLie;

// ---- the base ----

struct Case {
  const char* name;
  Channel channel;
  double factor;
};
std::string name_of(const testing::TestParamInfo<Case>& info) { return info.param.name; }

constexpr Case kLies[] = {
    {"EncoderStuck", Channel::kEncoder, 0},       {"EncoderHalf", Channel::kEncoder, 0.5},
    {"EncoderDouble", Channel::kEncoder, 2},      {"EncoderReversed", Channel::kEncoder, -1},
    {"PositionStuck", Channel::kPosition, 0},     {"PositionHalf", Channel::kPosition, 0.5},
    {"PositionDouble", Channel::kPosition, 2},    {"PositionReversed", Channel::kPosition, -1},
    {"VelocityHalf", Channel::kVelocity, 0.5},    {"VelocityDouble", Channel::kVelocity, 2},
    {"VelocityReversed", Channel::kVelocity, -1}, {"TorqueReversed", Channel::kTorque, -1},
    {"BoardFrozen", Channel::kBoard, 0},
};

class LyingWheel : public testing::TestWithParam<Case> {};
INSTANTIATE_TEST_SUITE_P(All, LyingWheel, testing::ValuesIn(kLies), name_of);

/// The bound: 60 ms and 0.1 m from the moment on that the lie begins, at 0.3 m/s.
TEST_P(LyingWheel, IsNamedWithin60MillisecondsAnd10Centimetres) {
  for (std::size_t wheel = 0; wheel < 4; ++wheel) {
    SCOPED_TRACE(wheel + 1);
    BaseRig rig;
    rig.motion.tell({0.3, 0.05, 0.0});
    rig.run(4s);
    ASSERT_FALSE(rig.cycle.stop_reason());
    ASSERT_GT(rig.base.twist()[0], 0.25);
    const control::PlanarPose begin = rig.base.pose();
    rig.liar.lie({wheel, GetParam().channel, GetParam().factor});
    rig.run(60ms);
    const runtime::StopReason& reason = rig.cycle.stop_reason();
    ASSERT_EQ(reason.kind, runtime::StopReason::Kind::kRobotFault);
    EXPECT_EQ(reason.joint, static_cast<int>(wheel)) << describe(reason, rig.robot);
    EXPECT_LT(std::hypot(rig.base.pose().x_m - begin.x_m, rig.base.pose().y_m - begin.y_m), 0.1);
  }
}

/// From rest nothing shows before it moves; then neither way nor speed are lost.
TEST(LyingWheel, StuckFromTheStartGoesNowhere) {
  for (std::size_t wheel = 0; wheel < 4; ++wheel) {
    SCOPED_TRACE(wheel + 1);
    BaseRig rig;
    rig.liar.lie({wheel, Channel::kEncoder, 0});
    rig.motion.tell({0.3, 0.0, 0.0});
    rig.run(4s);
    ASSERT_EQ(rig.cycle.stop_reason().kind, runtime::StopReason::Kind::kRobotFault);
    EXPECT_EQ(rig.cycle.stop_reason().joint, static_cast<int>(wheel));
    EXPECT_LT(std::hypot(rig.base.pose().x_m, rig.base.pose().y_m), 0.05);
  }
}

/// Two wheels explain one disagreement: then none is named, and that is said.
TEST(LyingWheel, WrongByAFactorFromTheStartEndsTheRunAndNamesNoOther) {
  for (const double factor : {0.5, 2.0})
    for (std::size_t wheel = 0; wheel < 4; ++wheel) {
      SCOPED_TRACE(testing::Message() << "wheel " << wheel + 1 << " times " << factor);
      BaseRig rig;
      rig.liar.lie({wheel, Channel::kEncoder, factor});
      rig.motion.tell({0.3, 0.0, 0.0});
      rig.run(2s);
      const runtime::StopReason& reason = rig.cycle.stop_reason();
      ASSERT_EQ(reason.kind, runtime::StopReason::Kind::kRobotFault);
      EXPECT_TRUE(reason.joint == static_cast<int>(wheel) || reason.joint == -1)
          << describe(reason, rig.robot);
      EXPECT_LT(std::hypot(rig.base.pose().x_m, rig.base.pose().y_m), 0.1);
    }
}

/// A wheel's encoder that counts backwards from power-up differs from the three others' on the first
/// centimetres; of two wheels it is not known which. Four that are reversed, or four motors that turn
/// backwards, drive the base against its torques.
TEST(LyingWheel, SeveralReversedFromTheStartEndTheRunOnTheFirstCentimetres) {
  struct Reversed {
    std::vector<std::size_t> wheels;
    Channel channel = Channel::kEncoder;
  };
  for (const Reversed& reversed : {Reversed{{1}}, Reversed{{0, 2}}, Reversed{{0, 1}}, Reversed{{1, 2}},
                                   Reversed{{0, 1, 2, 3}}, Reversed{{0, 1, 2, 3}, Channel::kMotor}})
    for (const control::PlanarVector& twist :
         {control::PlanarVector(0.3, 0, 0), control::PlanarVector(0, -0.3, 0),
          control::PlanarVector(0, 0, 0.6)}) {
      SCOPED_TRACE(testing::Message() << reversed.wheels.size() << " wheels from " << reversed.wheels.front()
                                      << ", " << twist.transpose());
      BaseRig rig;
      rig.motion.tell(control::PlanarVector::Zero());
      rig.run(500ms);
      for (const std::size_t wheel : reversed.wheels) rig.liar.lie({wheel, reversed.channel, -1});
      rig.motion.tell(twist);
      rig.run(1s);
      const runtime::StopReason& reason = rig.cycle.stop_reason();
      ASSERT_EQ(reason.kind, runtime::StopReason::Kind::kRobotFault) << describe(reason, rig.robot);
      if (reversed.wheels.size() == 1) {
        EXPECT_EQ(reason.joint, 1) << describe(reason, rig.robot);
      }
      EXPECT_LT(std::hypot(rig.base.pose().x_m, rig.base.pose().y_m), 0.1);
      EXPECT_LT(std::abs(rig.base.pose().yaw_rad), 0.2);
    }
}

TEST(TrueWheels, EndNoRunOnAnyFloorUnderAnyLoad) {
  std::mt19937 random(20261123);
  std::uniform_real_distribution<> share(0, 1);
  for (const double load : {0.6, 1.0, 3.0})
    for (const double grip : {0.6, 0.15, 0.05})
      for (const bool held : {false, true}) {
        SCOPED_TRACE(testing::Message() << "load " << load << ", grip " << grip << ", held " << held);
        sim::BaseParameters parameters;
        parameters.loaded_friction_scale.fill(load);
        parameters.roller_grip = grip;
        if (held) parameters.mass_kg = 3000;  // blocked in every direction
        parameters.noise_seed = random();
        BaseRig rig(parameters);
        for (int i = 0; i < 20; ++i) {
          rig.motion.tell({0.5 * share(random) - 0.25, 0.4 * share(random) - 0.2, 0.4 * share(random) - 0.2});
          rig.run(std::chrono::milliseconds(100 + static_cast<int>(1000 * share(random))));
        }
        // On ice a wheel may spin too fast; its sensors are not to blame.
        EXPECT_NE(rig.cycle.stop_reason().kind, runtime::StopReason::Kind::kRobotFault)
            << describe(rig.cycle.stop_reason(), rig.robot);
      }
}

// ---- the arm, in teleoperation ----

constexpr Case kArmLies[] = {
    {"EncoderStuck", Channel::kEncoder, 0},       {"EncoderReversed", Channel::kEncoder, -1},
    {"PositionStuck", Channel::kPosition, 0},     {"PositionReversed", Channel::kPosition, -1},
    {"VelocityReversed", Channel::kVelocity, -1}, {"BoardFrozen", Channel::kBoard, 0},
};
class LyingArm : public testing::TestWithParam<Case> {};
INSTANTIATE_TEST_SUITE_P(All, LyingArm, testing::ValuesIn(kArmLies), name_of);

/// While the arm is brought in front of the robot it turns at some tenths of a rad/s.
TEST_P(LyingArm, IsNamedBeforeTheJointHasGoneFar) {
  for (const std::size_t joint : {5U, 6U, 7U}) {  // those that move there
    SCOPED_TRACE(joint - 3);
    ArmRig rig;
    ASSERT_TRUE(rig.reach(TeleopPhase::kApproaching));
    rig.run(1500ms);
    ASSERT_FALSE(rig.over());
    const auto arm = static_cast<Eigen::Index>(joint - 4);
    const double begin_rad = rig.plant.arm_rad()[arm];
    rig.liar.lie({joint, GetParam().channel, GetParam().factor});
    rig.run(200ms);
    ASSERT_EQ(rig.cycle.task().end(), TeleopEnd::kRobotFault);
    EXPECT_EQ(rig.cycle.stop_reason().status.joint, static_cast<int>(joint))
        << describe(rig.cycle.stop_reason(), rig.robot, &rig.master);
    EXPECT_LT(std::abs(rig.plant.arm_rad()[arm] - begin_rad), 0.2);
  }
}

/// The board's position controller turns the motor by what its encoder shows.
TEST(LyingArm, ReversedBeforeTheBoardsUnfoldTheArmIsNamedOnTheFirstHundredths) {
  for (std::size_t joint = 4; joint < 9; ++joint) {
    SCOPED_TRACE(joint - 3);
    ArmRig rig{teleop_rig::Scene{}};
    ASSERT_TRUE(rig.reach(TeleopPhase::kUnfolding));
    const auto arm = static_cast<Eigen::Index>(joint - 4);
    const double begin_rad = rig.plant.arm_rad()[arm];
    rig.liar.lie({joint, Channel::kEncoder, -1});
    rig.reach(TeleopPhase::kApproaching);
    ASSERT_EQ(rig.cycle.task().end(), TeleopEnd::kRobotFault);
    EXPECT_EQ(rig.cycle.stop_reason().status.joint, static_cast<int>(joint))
        << describe(rig.cycle.stop_reason(), rig.robot, &rig.master);
    EXPECT_LT(std::abs(rig.plant.arm_rad()[arm] - begin_rad), 0.1);
  }
}

/// As over CAN: opposed_motion alone sees it.
TEST(LyingArm, ReversedBeforeItMovesIsNamedWithoutHallSensors) {
  control::ChecksOff off;
  off.add(control::PlausibilityCheck::kHallAgreement);
  for (std::size_t joint = 4; joint < 9; ++joint) {
    SCOPED_TRACE(joint - 3);
    ArmRig rig(teleop_rig::unfolded_scene(), off);
    ASSERT_TRUE(rig.reach(TeleopPhase::kApproaching));
    const auto arm = static_cast<Eigen::Index>(joint - 4);
    const double begin_rad = rig.plant.arm_rad()[arm];
    rig.liar.lie({joint, Channel::kEncoder, -1});
    rig.reach(TeleopPhase::kOperating);
    std::mt19937 random(1);
    rig.play(random, 20s);
    ASSERT_EQ(rig.cycle.task().end(), TeleopEnd::kRobotFault);
    EXPECT_EQ(rig.cycle.stop_reason().status.joint, static_cast<int>(joint))
        << describe(rig.cycle.stop_reason(), rig.robot, &rig.master);
    EXPECT_LT(std::abs(rig.plant.arm_rad()[arm] - begin_rad), 0.2);
  }
}

TEST(TrueArm, EndsNoRunInFreeSpaceNorAtAWallNorUnderAnyLoad) {
  std::mt19937 random(20261123);
  for (const double load : {0.6, 1.0, 3.0})
    for (const double wall_N_per_m : {0.0, 500.0, 20'000.0}) {
      SCOPED_TRACE(testing::Message() << "load " << load << ", wall " << wall_N_per_m);
      teleop_rig::Scene scene = teleop_rig::unfolded_scene();
      scene.robot.wheels.noise_seed = random();
      for (double& scale : scene.robot.wheels.loaded_friction_scale) scale *= load;
      for (sim::bus::ArmJointData& joint : scene.robot.arm) joint.coulomb_Nm *= load;
      if (wall_N_per_m > 0)
        scene.environment.walls.push_back({{0.38, 0, 0}, {-1, 0, 0}, {.stiffness_N_per_m = wall_N_per_m}});
      ArmRig rig(scene);
      // With three times the friction an end effector at a hard wall may not come to rest at its set-point.
      if (rig.reach(TeleopPhase::kOperating)) rig.play(random, 12s);
      rig.cycle.request_stop();
      for (int i = 0; i < 10'000 && !rig.cycle.finished(); ++i) rig.step();
      EXPECT_NE(rig.cycle.task().end(), TeleopEnd::kRobotFault)
          << describe(rig.cycle.stop_reason(), rig.robot, &rig.master);
      if (load < 3) {
        EXPECT_EQ(rig.cycle.task().end(), TeleopEnd::kRequested);
      }
    }
}

TEST(LateAnswers, ChecksKeptFromJudgingAreReported) {
  using control::PlausibilityCheck;
  BaseRig base(sim::BaseParameters{});
  ArmRig arm;
  const auto silent = [](auto& rig) {
    rig.run(1500ms);
    const control::ChecksOff checks = rig.cycle.silent_checks();
    return std::array{checks.has(PlausibilityCheck::kWheelAgreement),
                      checks.has(PlausibilityCheck::kOpposedMotion),
                      checks.has(PlausibilityCheck::kVelocityStep)};
  };
  EXPECT_EQ(silent(base), (std::array{false, false, false}));
  for (support::HeldUpRobot* bus : {&base.bus, &arm.bus})
    bus->hold_up([] { return support::HeldUpRobot::Delay{.answer = 1500us}; });
  EXPECT_EQ(silent(base), (std::array{true, false, true})) << "it has no arm";
  EXPECT_EQ(silent(arm), (std::array{true, true, true}));
  // Now and then one in time is enough, but for steps.
  int n = 0;
  base.bus.hold_up([&n] { return support::HeldUpRobot::Delay{.answer = n++ % 50 == 0 ? 0us : 1500us}; });
  EXPECT_EQ(silent(base), (std::array{false, false, true}));
  base.bus.hold_up({});
  EXPECT_EQ(silent(base), (std::array{false, false, false}));
  EXPECT_TRUE(base.cycle.once_silent_checks().has(PlausibilityCheck::kVelocityStep)) << "it was";
  EXPECT_FALSE(base.cycle.once_silent_checks().has(PlausibilityCheck::kOpposedMotion));
}

// ---- over EtherCAT, where drives report their Hall sensors, too ----

/// One frame in eight is lost on the way out or back, singly and in bursts that are bridged.
TEST(TrueBoard, EndsNoRunWhileFramesAreLost) {
  std::mt19937 random(20261124);
  std::vector<hal::test::FaultEvent> faults;
  for (auto at = std::chrono::nanoseconds(3s); at < 40s;) {
    const auto burst = static_cast<std::uint32_t>(1 + random() % 5);
    faults.push_back(
        {.kind = random() % 2 == 0 ? sim::bus::FaultKind::kDropReply : sim::bus::FaultKind::kDropRequest,
         .at = at,
         .count = burst});
    at += std::chrono::milliseconds(burst + 9 + random() % 22);
  }
  hal::test::EthercatRig rig(hal::YoubotKind::kBaseAndArm, drivers::tmcl::Firmware::k148, faults);
  runtime::MonitoredRobot robot(*rig.robot, control::PlausibilityMonitor::Wheels::kFree, {});
  robot.activate();
  hal::CycleStatus status;
  int most_lost = 0;
  rig.command.enable = true;
  for (int i = 0; i < 40'000 && status.ok(); ++i) {
    // To and fro, at speeds up to those at which a reading is still judged.
    const double time_s = i * 1e-3;
    for (std::size_t joint = 0; joint < 9; ++joint)
      rig.command.joints[joint] =
          hal::JointCommand::velocity_rad_per_s((joint < 4    ? 2.5
                                                 : joint == 6 ? -0.4
                                                              : 0.4) *
                                                std::sin(3 * time_s) * std::sin(0.2 * time_s));
    rig.clock.sleep_until(rig.clock.now() + 1ms);
    status = robot.exchange(rig.command, rig.sample);
    rig.emulation.advance(1ms);
    most_lost = std::max(most_lost, rig.robot->losses()->cycles);
  }
  EXPECT_TRUE(status.ok()) << rig.robot->explain(status);
  EXPECT_GT(most_lost, 100) << "of 1000";
  for (std::size_t joint = 0; joint < 9; ++joint)
    EXPECT_GT(rig.sample.joints[joint].rotor.number, 500U) << joint;
  robot.deactivate();
}

/// Every joint of base and arm in turn, at rest until its encoder lies, then slowly moved by its drive.
TEST(LyingBoard, AnEncoderOfAnotherScaleIsNamedBeforeItsJointHasGoneATenthOfARadian) {
  for (const double factor : {0.0, 0.5, 2.0, -1.0})
    for (std::size_t joint = 0; joint < 9; ++joint) {
      SCOPED_TRACE(testing::Message() << "joint " << joint << " times " << factor);
      hal::test::EthercatRig rig(hal::YoubotKind::kBaseAndArm);
      support::LyingBoard board(rig.emulation.board(joint), rig.emulation.slave(joint));
      runtime::MonitoredRobot robot(*rig.robot, control::PlausibilityMonitor::Wheels::kFree, {});
      robot.activate();
      hal::CycleStatus status;
      const auto step = [&](double velocity_rad_per_s) {
        rig.clock.sleep_until(rig.clock.now() + 1ms);
        rig.command.joints.fill(hal::JointCommand::velocity_rad_per_s(velocity_rad_per_s));
        rig.command.joints[6].target *= -1;  // arm-3 is folded at the other end of its range
        status = robot.exchange(rig.command, rig.sample);
        rig.emulation.advance(1ms);
      };
      rig.command.enable = true;
      for (int i = 0; i < 20'000 && !rig.sample.enabled; ++i) step(0);
      // The Hall sensors have been seen to turn, and the encoder to agree.
      for (int i = 0; i < 1500; ++i) step(0.1);
      for (int i = 0; i < 500; ++i) step(0);
      ASSERT_TRUE(status.ok()) << describe(status.fault);
      const auto true_rad = [&] { return rig.emulation.position_rad(joint); };
      const double begin_rad = true_rad();
      board.lie([factor](const support::BoardInputs& begin, const support::BoardInputs& now) {
        support::BoardInputs shown = now;
        shown.position = begin.position + static_cast<int>(factor * (now.position - begin.position));
        shown.velocity = static_cast<int>(factor * now.velocity);
        return shown;
      });
      for (int i = 0; i < 2000 && status.ok(); ++i) step(0.15);
      ASSERT_EQ(status.fault, hal::Fault::kJointFault);
      EXPECT_EQ(status.joint, static_cast<int>(joint));
      EXPECT_LT(std::abs(true_rad() - begin_rad), 0.1);
      robot.deactivate();
    }
}

}  // namespace lying_sensor_test
