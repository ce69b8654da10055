// One sensor of the simulated robot lies: the run ends, names the joint, and nothing has gone far. And true
// sensors on floors, walls and loads of all kinds end no run. In virtual time.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <random>
#include <string>

#include "apps/youbotd/cycle.h"
#include "apps/youbotd/teleop_cycle.h"
#include "apps/youbotd/velocity_source.h"
#include "hal/clock.h"
#include "hal/loopback_robot.h"
#include "sim/base.h"
#include "tests/apps/teleop_rig.h"
#include "tests/support/lying_robot.h"

namespace lying_sensor_test {

using namespace std::chrono_literals;
using control::TeleopEnd;
using control::TeleopPhase;
using hal::JointFault;
using support::Channel;
using support::Lie;

// ---- the base ----

struct BaseRig {
  explicit BaseRig(const sim::BaseParameters& parameters = {}) : base(parameters) { robot.activate(); }

  static std::vector<hal::JointInfo> wheels() {
    std::vector<hal::JointInfo> wheels;
    for (int i = 1; i <= 4; ++i) wheels.push_back({"wheel-" + std::to_string(i), 2.467, 16.2});
    return wheels;
  }
  static youbotd::Cycle::Config config() {
    youbotd::Cycle::Config config;
    config.controller.wrench_limits = {60.0, 20.0};
    return config;
  }
  void run(std::chrono::milliseconds duration) {
    for (auto left = duration; left > 0ms && !cycle.stop_reason(); left -= 1ms) {
      clock.sleep_until(clock.now() + 1ms);
      cycle.step(clock.now());
    }
  }

  hal::VirtualClock clock;
  sim::Base base;
  hal::LoopbackRobot robot{base, clock, 1ms, wheels()};
  support::LyingRobot liar{robot};
  youbotd::VelocitySource motion{control::BasePath::Limits{0.8, 0.5, 1.5, 1.5},
                                 1ms,
                                 {.m = 0.09, .rad = 0.18},
                                 control::Workspace{}.base_W_m};
  youbotd::Cycle cycle{config(), liar, motion, nullptr};
};

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
    const youbotd::StopReason& reason = rig.cycle.stop_reason();
    ASSERT_EQ(reason.kind, youbotd::StopReason::Kind::kRobotFault);
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
    ASSERT_EQ(rig.cycle.stop_reason().kind, youbotd::StopReason::Kind::kRobotFault);
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
      const youbotd::StopReason& reason = rig.cycle.stop_reason();
      ASSERT_EQ(reason.kind, youbotd::StopReason::Kind::kRobotFault);
      EXPECT_TRUE(reason.joint == static_cast<int>(wheel) || reason.joint == -1)
          << describe(reason, rig.robot);
      EXPECT_LT(std::hypot(rig.base.pose().x_m, rig.base.pose().y_m), 0.1);
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
        if (held) parameters.mass_kg = 3000;  // against a wall of its own, in every direction
        parameters.noise_seed = random();
        BaseRig rig(parameters);
        for (int i = 0; i < 20; ++i) {
          rig.motion.tell({0.5 * share(random) - 0.25, 0.4 * share(random) - 0.2, 0.4 * share(random) - 0.2});
          rig.run(std::chrono::milliseconds(100 + static_cast<int>(1000 * share(random))));
        }
        // On ice a wheel may spin too fast; its sensors are not to blame.
        EXPECT_NE(rig.cycle.stop_reason().kind, youbotd::StopReason::Kind::kRobotFault)
            << describe(rig.cycle.stop_reason(), rig.robot);
      }
}

// ---- the arm, in teleoperation ----

std::vector<hal::JointInfo> robot_joints() {
  std::vector<hal::JointInfo> joints = BaseRig::wheels();
  const double limits_Nm[] = {15.68, 15.68, 10.05, 10.86, 3.48};
  for (int i = 0; i < 5; ++i) joints.push_back({"arm-" + std::to_string(i + 1), limits_Nm[i], 1.57});
  return joints;
}

struct ArmRig {
  explicit ArmRig(const teleop_rig::Scene& scene = teleop_rig::unfolded_scene())
      : plant(scene.robot, scene.environment), hand(scene.hand) {
    robot.activate();
    master.activate();
  }
  bool over() const { return cycle.end().end != TeleopEnd::kNone; }
  void step() {
    clock.sleep_until(clock.now() + 1ms);
    cycle.step(clock.now());
  }
  void run(std::chrono::milliseconds duration) {
    for (auto left = duration; left > 0ms && !over(); left -= 1ms) step();
  }
  bool reach(TeleopPhase phase) {
    for (int i = 0; i < 60'000 && !over() && cycle.phase() != phase; ++i) step();
    return cycle.phase() == phase;
  }
  /// The hand leads the tip about for so long.
  void play(std::mt19937& random, std::chrono::milliseconds duration) {
    std::uniform_real_distribution<> both(-1, 1);
    for (auto left = duration; left > 0ms && !over(); left -= 1200ms) {
      hand.move_to({0.04 * both(random), 0.04 * both(random), 0.04 * both(random)}, 900ms);
      hand.turn_to(Eigen::Quaterniond(Eigen::AngleAxisd(0.3 * both(random), Eigen::Vector3d::UnitY())),
                   900ms);
      run(1200ms);
    }
  }

  hal::VirtualClock clock;
  sim::MobileManipulator plant;
  sim::Hand hand;
  hal::LoopbackRobot robot{plant, clock, 1ms, robot_joints()};
  hal::LockstepHapticDevice master{
      std::make_unique<hal::LoopbackHapticLink>(
          hand, 1ms, hal::HapticInfo{.name = "pen", .force_limit_N = 8.0, .senses_rotation = true}),
      clock,
      {}};
  support::LyingRobot liar{robot};
  youbotd::TeleopCycle cycle{teleop_rig::quick_config(), liar, master};
};

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
    ASSERT_EQ(rig.cycle.end().end, TeleopEnd::kRobotFault);
    EXPECT_EQ(rig.cycle.end().robot.joint, static_cast<int>(joint))
        << describe(rig.cycle.end(), rig.robot, rig.master);
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
      // With three times the friction a tip at a hard wall may not come to rest where it is wanted.
      if (rig.reach(TeleopPhase::kOperating)) rig.play(random, 12s);
      rig.cycle.request_stop();
      for (int i = 0; i < 10'000 && !rig.cycle.finished(); ++i) rig.step();
      EXPECT_NE(rig.cycle.end().end, TeleopEnd::kRobotFault)
          << describe(rig.cycle.end(), rig.robot, rig.master);
      if (load < 3) {
        EXPECT_EQ(rig.cycle.end().end, TeleopEnd::kRequested);
      }
    }
}

}  // namespace lying_sensor_test
