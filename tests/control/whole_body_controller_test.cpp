// Base and arm at a spring: virtual work, mechanics that must not affect the end effector, and coming to
// rest.
#include "control/whole_body_controller.h"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <cmath>
#include <limits>
#include <numbers>
#include <random>
#include <stdexcept>
#include <string>

#include "tests/support/no_alloc_guard.h"

namespace whole_body_controller_test {

using control::ArmVector;
using control::CartesianStiffness;
using control::ChainMatrix;
using control::ChainVector;
using control::kArmJoints;
using control::kBaseAxes;
using control::LinkMap;
using control::PlanarVector;
using control::RobotModel;
using control::rotated;
using control::TipSetpoint;
using control::WheelVector;
using control::WholeBodyController;
using control::Wrench;
using Eigen::AngleAxisd;
using Eigen::Quaterniond;
using Eigen::Vector3d;

constexpr double kDegree = std::numbers::pi / 180;
constexpr double kPeriod_s = 1e-3;
const LinkMap kMap = LinkMap::with_geometry({});
/// Elbow up, hand ahead: no limit near.
const ArmVector kBent = kDegree * (ArmVector() << 169, 65 - 10, -146 + 80, 102.5 + 40, 167.5).finished();
const CartesianStiffness kStiff{700, 30};

/// Nothing but the springs: no friction to overcome, no limit within reach.
WholeBodyController::Config bare() {
  WholeBodyController::Config config;
  config.period_s = kPeriod_s;
  config.base.wrench_limits = {.force_N = 1e4, .moment_Nm = 1e4};
  config.base.torque_limit_Nm = 1e4;
  config.base.compensate_friction = false;
  config.spring = {.force_limit_N = 1e4, .moment_limit_Nm = 1e4};
  config.arm_compensator.margin = 0;
  config.arm_torque_limit_Nm.fill(1e4);
  config.posture_stiffness_Nm_per_rad = 6;
  config.posture_torque_limit_Nm = 3;
  config.settling_limit_Nm = {3, 3, 2, 1, 0.5};
  return config;
}

/// A robot that was driven to where it stands, and has stood there for long.
struct Robot {
  explicit Robot(const WholeBodyController::Config& config, const ArmVector& posture_rad = kBent)
      : controller(config), arm_rad(posture_rad) {
    controller.reset(wheels_rad, arm_rad);
    drive({0.2, -0.1, 0.7});
    drive(PlanarVector::Zero());
    controller.set_posture(arm_rad);
  }
  /// At this twist for a second.
  void drive(const PlanarVector& twist_B) {
    for (int n = 0; n < 1000; ++n)
      controller.sense(wheels_rad += kPeriod_s * kMap.wheel_velocity(twist_B), arm_rad);
  }
  TipSetpoint off_by(const Vector3d& way_m, const Vector3d& turn_rad) const {
    const Eigen::Isometry3d& X_WT = controller.state().X_WT;
    const AngleAxisd turn(turn_rad.norm(), turn_rad.normalized());
    return {{X_WT.translation() + way_m, Quaterniond(turn * X_WT.linear())}, Vector3d::Zero()};
  }
  TipSetpoint here() const { return off_by(Vector3d::Zero(), Vector3d::UnitX() * 1e-300); }
  /// Generalized forces of the output along the axes of the chain, including the weight.
  ChainVector force_of(const WholeBodyController::Output& output) const {
    return (ChainVector() << rotated(kMap.wrench(output.wheel_torque_Nm), controller.state().X_WB.yaw_rad),
            output.arm_torque_Nm)
        .finished();
  }

  WholeBodyController controller;
  WheelVector wheels_rad = WheelVector::Zero();
  ArmVector arm_rad;
};

TEST(WholeBodyController, StaticTorquesDoTheWorkOfTheTipsWrenchAndCarryTheWeight) {
  Robot robot(bare());
  RobotModel model;
  const ChainVector q = robot.controller.state().position;
  const TipSetpoint setpoint = robot.off_by({0.02, -0.03, 0.01}, {0.05, 0.1, -0.07});
  const auto output = robot.controller.track(setpoint, kStiff);
  EXPECT_LT((output.wrench_W.head<3>() - 700 * Vector3d(0.02, -0.03, 0.01)).norm(), 1e-6);
  EXPECT_LT((output.wrench_W.tail<3>() - 30 * Vector3d(0.05, 0.1, -0.07)).norm(), 1e-6);
  const ChainVector force = robot.force_of(output);
  model.update(q);
  const ChainVector gravity = model.gravity_Nm();
  constexpr double kStep = 1e-6;
  for (int i = 0; i < control::kChainAxes; ++i) {
    const auto tip = [&](double step) {
      model.update(q + step * ChainVector::Unit(i));
      return model.X_WT();
    };
    const Eigen::Isometry3d ahead = tip(kStep), behind = tip(-kStep);
    const AngleAxisd turn(Eigen::Matrix3d(ahead.linear() * behind.linear().transpose()));
    const double work_J = output.wrench_W.head<3>().dot(ahead.translation() - behind.translation()) +
                          output.wrench_W.tail<3>().dot(turn.angle() * turn.axis());
    EXPECT_NEAR(force[i], work_J / (2 * kStep) + gravity[i], 1e-5) << "axis " << i;
  }
  EXPECT_FALSE(output.limited);
  EXPECT_FALSE(output.protecting);
}

TEST(WholeBodyController, ASampleThatIsNoNewOneChangesNothingThatIsKnownAndIsNotSummedUp) {
  Robot robot(bare());
  robot.drive({0.1, 0, 0.3});
  const TipSetpoint setpoint = robot.off_by({0.01, 0, 0.01}, {0, 0.1, 0});
  const ArmVector known_Nm = robot.controller.settle(setpoint, kStiff, true).arm_torque_Nm;
  const ChainVector velocity = robot.controller.state().velocity;
  ASSERT_GT(velocity.norm(), 0.3);
  for (int n = 0; n < 10; ++n) {
    EXPECT_EQ(robot.controller.sense(robot.wheels_rad, robot.arm_rad, 0.0).velocity, velocity);
    EXPECT_TRUE(robot.controller.settle(setpoint, kStiff, true).arm_torque_Nm.isApprox(known_Nm, 1e-12));
  }
  robot.controller.sense(robot.wheels_rad, robot.arm_rad);
  EXPECT_FALSE(robot.controller.settle(setpoint, kStiff, true).arm_torque_Nm.isApprox(known_Nm, 1e-6));
}

TEST(WholeBodyController, ReportsPoseAndVelocityOfTheEndEffector) {
  Robot robot(bare());
  EXPECT_NEAR(robot.controller.state().velocity.norm(), 0, 1e-6);
  robot.drive({0, 0, 0.3});
  const auto& state = robot.controller.state();
  RobotModel model;
  model.update(state.position);
  EXPECT_TRUE(state.X_WT.isApprox(model.X_WT(), 1e-12));
  // Round the base's middle.
  const Vector3d lever_m = state.X_WT.translation() - Vector3d(state.X_WB.x_m, state.X_WB.y_m, 0);
  EXPECT_LT((state.tip_velocity_W.head<3>() - Vector3d(0, 0, 0.3).cross(lever_m)).norm(), 1e-3);
  EXPECT_LT((state.tip_velocity_W.tail<3>() - Vector3d(0, 0, 0.3)).norm(), 1e-3);
}

TEST(WholeBodyController, ThePullTowardsAPostureHardlyMovesTheTip) {
  // For links with rotors and wheels in round numbers: J·M⁻¹·τ is the acceleration of the end effector.
  const ChainVector reflected =
      (ChainVector() << 18.8, 18.8, 2.8, 0.33, 0.33, 0.135, 0.068, 0.068).finished();
  RobotModel model;
  std::mt19937 random(43);
  std::uniform_real_distribution<double> any(-1, 1);
  for (int n = 0; n < 20; ++n) {
    Robot robot(bare(), kBent + ArmVector(ArmVector::NullaryExpr([&] { return 0.3 * any(random); })));
    const ArmVector pull_Nm = ArmVector::NullaryExpr([&] { return 2 * any(random); });
    const ChainVector without = robot.force_of(robot.controller.track(robot.here(), kStiff));
    robot.controller.set_posture(robot.arm_rad + pull_Nm / 6);
    const ChainVector with = robot.force_of(robot.controller.track(robot.here(), kStiff));
    model.update(robot.controller.state().position);
    ChainMatrix mass = model.mass();
    mass.diagonal() += reflected;
    const auto tip_acceleration = [&](const ChainVector& force) {
      return Wrench(model.J_WT() * mass.ldlt().solve(force));
    };
    const ChainVector wanted = (ChainVector() << PlanarVector::Zero(), pull_Nm).finished();
    EXPECT_GT((with - without).norm(), 0.1);
    // What is left is by what bounds the inverse at singular poses.
    EXPECT_LT(tip_acceleration(with - without).norm(), 0.02 * tip_acceleration(wanted).norm()) << n;
    EXPECT_GT((with - without).dot(mass.ldlt().solve(wanted)), 0) << "towards the posture";
  }
}

TEST(WholeBodyController, ThePullTowardsAPostureIsLimited) {
  Robot robot(bare());
  const ChainVector none = robot.force_of(robot.controller.track(robot.here(), kStiff));
  const auto pulled = [&](double joint_3_rad) {
    robot.controller.set_posture(robot.arm_rad + joint_3_rad * ArmVector::Unit(2));
    return ChainVector(robot.force_of(robot.controller.track(robot.here(), kStiff)) - none);
  };
  const ChainVector at_limit = pulled(0.5);
  EXPECT_TRUE(pulled(0.25).isApprox(at_limit / 2, 1e-6));
  EXPECT_TRUE(pulled(5).isApprox(at_limit, 1e-6));
}

TEST(WholeBodyController, SettlingMovesTheArmAloneAndBrakesTheBase) {
  Robot robot(bare());
  const TipSetpoint setpoint = robot.off_by({0.05, 0.02, -0.01}, {0, 0.1, 0});
  const auto tracked = robot.controller.track(setpoint, kStiff);
  const auto standing = robot.controller.settle(setpoint, kStiff, false);
  EXPECT_LT(standing.wheel_torque_Nm.norm(), 1e-6) << "a base that stands is left alone";
  EXPECT_TRUE(standing.arm_torque_Nm.isApprox(tracked.arm_torque_Nm, 1e-6));

  for (const PlanarVector& twist_B :
       {PlanarVector(0.1, 0, 0), PlanarVector(0, -0.1, 0), PlanarVector(0, 0, 0.3)}) {
    robot.drive(twist_B);
    const auto moving = robot.controller.settle(setpoint, kStiff, false);
    const PlanarVector brake_B = kMap.wrench(moving.wheel_torque_Nm);
    EXPECT_LT(brake_B.dot(twist_B), -0.5 * twist_B.norm()) << "against its motion";
    EXPECT_LT(brake_B.normalized().cross(twist_B.normalized()).norm(), 0.02) << brake_B.transpose();
    EXPECT_EQ(robot.controller.brake_base(), moving.wheel_torque_Nm);
  }
}

TEST(WholeBodyController, SettlingPullsEachJointToItsPosture) {
  Robot robot(bare());
  const ArmVector before_Nm = robot.controller.settle(robot.here(), kStiff, false).arm_torque_Nm;
  const ArmVector off_rad = (ArmVector() << 0.1, -0.2, 0.3, -0.4, 2).finished();
  robot.controller.set_posture(robot.arm_rad + off_rad);
  const ArmVector pulled_Nm = robot.controller.settle(robot.here(), kStiff, false).arm_torque_Nm - before_Nm;
  EXPECT_TRUE(pulled_Nm.isApprox((ArmVector() << 0.6, -1.2, 1.8, -2.4, 3).finished(), 1e-6))
      << pulled_Nm.transpose();
}

TEST(WholeBodyController, SumsUpWhatIsLeftWhileItSettlesAndNoMoreThanItMay) {
  Robot robot(bare());
  const TipSetpoint setpoint = robot.off_by({0.005, 0, 0.01}, {0, 0.01, 0});
  const auto torque = [&](bool summing) {
    return robot.controller.settle(setpoint, kStiff, summing).arm_torque_Nm;
  };
  RobotModel model;
  model.update(robot.controller.state().position);
  const ArmVector weight_Nm = model.gravity_Nm().tail<kArmJoints>();
  const ArmVector first_Nm = torque(false);
  EXPECT_TRUE(torque(false).isApprox(first_Nm, 1e-9));
  for (int n = 0; n < 100; ++n) torque(true);
  // A rate of 3 a second, for a tenth of one.
  EXPECT_TRUE((torque(false) - first_Nm).isApprox(0.3 * (first_Nm - weight_Nm), 1e-6));
  for (int n = 0; n < 100'000; ++n) torque(true);
  const ArmVector most_Nm = (torque(false) - first_Nm).cwiseAbs();
  const ArmVector limit_Nm = (ArmVector() << 3, 3, 2, 1, 0.5).finished();
  EXPECT_LE((most_Nm - limit_Nm).maxCoeff(), 1e-9);
  EXPECT_NEAR(most_Nm[1], 3, 1e-9);
}

TEST(WholeBodyController, AnAdoptedRestKeepsTheTorqueWhenTheSetPointComesToTheTip) {
  WholeBodyController::Config config = bare();
  config.settled_fade_s = 5;
  config.settling_limit_Nm = {20, 20, 20, 20, 20};
  config.arm_compensator = {.margin = 0.8, .full_command_Nm = 0.15};
  Robot robot(config);
  const TipSetpoint setpoint = robot.off_by({0.005, 0.002, 0.008}, {0.01, 0.02, 0});
  robot.controller.set_posture(robot.arm_rad + ArmVector::Constant(0.05));
  ArmVector resting_Nm;
  for (int n = 0; n < 300; ++n) resting_Nm = robot.controller.settle(setpoint, kStiff, true).arm_torque_Nm;
  robot.controller.set_posture(robot.arm_rad);
  robot.controller.adopt_rest();
  EXPECT_TRUE(robot.controller.settle(robot.here(), kStiff, false).arm_torque_Nm.isApprox(resting_Nm, 1e-6));
  EXPECT_TRUE(robot.controller.settle(robot.here(), kStiff, false).arm_torque_Nm.isApprox(resting_Nm, 1e-6))
      << "and goes on keeping it";

  // Tracking forgets it with its time constant.
  RobotModel model;
  model.update(robot.controller.state().position);
  const ArmVector weight_Nm = model.gravity_Nm().tail<kArmJoints>();
  const ArmVector adopted_Nm = resting_Nm - weight_Nm;
  ArmVector tracked_Nm;
  for (int n = 0; n < 5000; ++n) tracked_Nm = robot.controller.track(robot.here(), kStiff).arm_torque_Nm;
  EXPECT_TRUE((tracked_Nm - weight_Nm).isApprox(std::exp(-1) * adopted_Nm, 1e-3));
}

TEST(WholeBodyController, ResetForgetsWhatItHasSummedUpAndWhereItStands) {
  Robot robot(bare());
  const auto torque = [&] { return robot.controller.settle(robot.here(), kStiff, false).arm_torque_Nm; };
  const ArmVector before_Nm = torque();
  for (int n = 0; n < 200; ++n)
    robot.controller.settle(robot.off_by({0.01, 0, 0.01}, {0, 0.1, 0}), kStiff, true);
  EXPECT_GT((torque() - before_Nm).norm(), 0.1);
  robot.controller.reset(robot.wheels_rad, robot.arm_rad);
  const auto& state = robot.controller.sense(robot.wheels_rad, robot.arm_rad);
  EXPECT_LT(state.position.head<kBaseAxes>().norm(), 1e-12);
  EXPECT_LT(state.velocity.norm(), 1e-9);
  EXPECT_TRUE(torque().isApprox(before_Nm, 1e-9));
}

TEST(WholeBodyController, CutsTorquesAtTheJointsLimitsAndSaysSo) {
  WholeBodyController::Config config = bare();
  config.arm_torque_limit_Nm = {1, 2, 1, 0.5, 0.1};
  Robot robot(config);
  const auto output = robot.controller.track(robot.off_by({0.3, 0.3, 0.3}, {0.5, 0.5, 0.5}), kStiff);
  EXPECT_TRUE(output.limited);
  const ArmVector limit_Nm = (ArmVector() << 1, 2, 1, 0.5, 0.1).finished();
  EXPECT_LE((output.arm_torque_Nm.cwiseAbs() - limit_Nm).maxCoeff(), 0);
  EXPECT_NEAR(std::abs(output.arm_torque_Nm[1]), 2, 1e-12);
}

TEST(WholeBodyController, PushesAJointOffItsEndStop) {
  ArmVector at_stop_rad = kBent;
  at_stop_rad[3] = RobotModel().ranges()[3].upper_rad - 0.02;
  Robot robot(bare(), at_stop_rad);
  RobotModel model;
  model.update(robot.controller.state().position);
  const auto output = robot.controller.track(robot.here(), kStiff);
  EXPECT_TRUE(output.protecting);
  EXPECT_LT(output.arm_torque_Nm[3], model.gravity_Nm()[kBaseAxes + 3] - 0.5);
}

TEST(WholeBodyController, WhatIsSummedUpDrivesNoJointTowardsItsStopEither) {
  ArmVector at_stop_rad = kBent;
  at_stop_rad[3] = RobotModel().ranges()[3].upper_rad - 0.03;  // a fifth of the margin is left
  for (const double direction : {1.0, -1.0}) {
    Robot robot(bare(), at_stop_rad);
    ArmVector posture_rad = at_stop_rad;
    posture_rad[3] += 0.1 * direction;
    robot.controller.set_posture(posture_rad);
    const auto torque_Nm = [&](bool summing) {
      return robot.controller.settle(robot.here(), kStiff, summing).arm_torque_Nm[3];
    };
    const double before_Nm = torque_Nm(false);
    for (int n = 0; n < 2000; ++n) torque_Nm(true);
    EXPECT_NEAR(torque_Nm(false) - before_Nm, direction > 0 ? 0.2 : -1.0, 1e-6) << "of 1 N·m";
  }
}

TEST(WholeBodyController, RefusesWhatIsOutOfRangeByName) {
  const auto refusal = [](const WholeBodyController::Config& config) -> std::string {
    try {
      const WholeBodyController controller(config);
    } catch (const std::invalid_argument& error) {
      return error.what();
    }
    return "none";
  };
  EXPECT_EQ(refusal(bare()), "none");
  for (const double bad : {0.0, -1.0, std::numeric_limits<double>::quiet_NaN()}) {
    WholeBodyController::Config period = bare(), fade = bare(), pull = bare(), limit = bare(),
                                spring = bare(), rotor = bare();
    rotor.rotor_inertia_kg_m2[4] = bad;
    period.period_s = fade.settled_fade_s = pull.posture_torque_limit_Nm = bad;
    limit.arm_torque_limit_Nm[2] = spring.spring.damping_ratio = bad;
    EXPECT_NE(refusal(period).find("period_s"), std::string::npos);
    EXPECT_NE(refusal(fade).find("settled_fade_s"), std::string::npos);
    EXPECT_NE(refusal(pull).find("posture_torque_limit_Nm"), std::string::npos);
    EXPECT_NE(refusal(limit).find("arm_torque_limit_Nm"), std::string::npos);
    EXPECT_NE(refusal(spring).find("damping_ratio"), std::string::npos);
    EXPECT_NE(refusal(rotor).find("rotor_inertia_kg_m2"), std::string::npos);
  }
  for (const double bad : {-0.1, std::numeric_limits<double>::infinity()}) {
    WholeBodyController::Config config = bare();
    config.arm_friction.coulomb_Nm[3] = bad;
    EXPECT_NE(refusal(config).find("arm joint 4"), std::string::npos) << refusal(config);
  }
}

TEST(WholeBodyController, NeitherSensingNorDrivingAllocatesOrLocks) {
  if (!support::NoAllocGuard::kActive) GTEST_SKIP() << "the sanitizer owns malloc";
  Robot robot({});
  double sum_Nm = 0;
  const support::NoAllocGuard guard;
  for (int n = 0; n < 10; ++n) {
    robot.controller.sense(robot.wheels_rad, robot.arm_rad);
    const TipSetpoint setpoint = robot.off_by({0.1, 0, 0.1}, {0, 0.1, 0});
    sum_Nm += robot.controller.track(setpoint, kStiff).arm_torque_Nm.norm();
    sum_Nm += robot.controller.settle(setpoint, kStiff, true).arm_torque_Nm.norm();
    robot.controller.adopt_rest();
  }
  robot.controller.forget_velocity(robot.wheels_rad, robot.arm_rad);
  robot.controller.reset(robot.wheels_rad, robot.arm_rad);
  EXPECT_EQ(guard.violations(), 0);
  EXPECT_GT(sum_Nm, 0);
}

}  // namespace whole_body_controller_test
