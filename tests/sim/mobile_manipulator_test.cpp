// The simulated robot as a whole: energy, momentum, weight, friction, contact, and the reports of its joints.
#include "sim/mobile_manipulator.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <limits>
#include <numbers>
#include <stdexcept>
#include <string>

#include "control/link_map.h"
#include "sim/base.h"
#include "tests/support/no_alloc_guard.h"

namespace mobile_manipulator_test {

using namespace std::chrono_literals;
using control::ArmVector;
using control::ChainVector;
using control::RobotModel;
using Eigen::Vector3d;
using hal::JointCommand;
using sim::EnvironmentParameters;
using sim::MobileManipulator;
using sim::MobileManipulatorParameters;

constexpr double kGravity_m_per_s2 = 9.81;
constexpr double degrees(double value) { return value * std::numbers::pi / 180; }
/// Straight up; straight and ahead, ten degrees above the horizontal; and bent.
const ArmVector kCandle(degrees(169), degrees(65), degrees(-146), degrees(102.5), degrees(167.5));
const ArmVector kAhead(degrees(169), degrees(65 + 80), degrees(-146), degrees(102.5), degrees(167.5));
const ArmVector kElbowUp(degrees(169), degrees(80), degrees(-80), degrees(120), degrees(167.5));

using Commands = std::array<JointCommand, 9>;
/// The wheels hold themselves.
Commands torques(const ArmVector& torque_Nm) {
  Commands commands;
  commands.fill(JointCommand::velocity_rad_per_s(0));
  for (int i = 0; i < 5; ++i)
    commands[static_cast<std::size_t>(4 + i)] = JointCommand::torque_Nm(torque_Nm[i]);
  return commands;
}
Commands standing() {
  Commands commands;
  commands.fill(JointCommand::velocity_rad_per_s(0));
  return commands;
}
Commands positions(const ArmVector& angle_rad) {
  Commands commands = standing();
  for (int i = 0; i < 5; ++i)
    commands[static_cast<std::size_t>(4 + i)] = JointCommand::position_rad(angle_rad[i]);
  return commands;
}

MobileManipulatorParameters starting_at(const ArmVector& start_rad) {
  MobileManipulatorParameters parameters;
  parameters.start_rad = start_rad;
  return parameters;
}
MobileManipulatorParameters without_joint_friction(MobileManipulatorParameters parameters) {
  for (sim::bus::ArmJointData& joint : parameters.arm) joint.coulomb_Nm = joint.viscous_Nm_s_per_rad = 0;
  return parameters;
}
/// On ice.
MobileManipulatorParameters without_grip(MobileManipulatorParameters parameters) {
  parameters.wheels.roller_grip = 0;
  parameters.wheels.roller_resistance = 0;
  return parameters;
}
MobileManipulatorParameters base_held(MobileManipulatorParameters parameters) {
  parameters.wheels.on_ground = false;
  return parameters;
}
MobileManipulatorParameters as_described(MobileManipulatorParameters parameters) {
  parameters.masses = {};
  return parameters;
}

ChainVector chain(const MobileManipulator& robot) {
  ChainVector q;
  q << robot.pose().x_m, robot.pose().y_m, robot.pose().yaw_rad, robot.arm_rad();
  return q;
}
double energy_J(MobileManipulator& robot) { return robot.kinetic_energy_J() + robot.potential_energy_J(); }

/// Arm torques that carry the links of `model`, from the joint samples.
ArmVector carrying(RobotModel& model, MobileManipulator& robot) {
  std::array<hal::JointSample, 9> samples;
  robot.measure(samples);
  ChainVector q = ChainVector::Zero();
  for (int i = 0; i < 5; ++i) q[3 + i] = samples[static_cast<std::size_t>(4 + i)].position_rad;
  model.update(q);
  return model.gravity_Nm().tail<5>();
}

TEST(MobileManipulator, AFrictionlessArmFallsAndKeepsItsEnergy) {
  for (const bool held : {true, false})
    for (const ArmVector& start :
         {ArmVector(2.0, 1.6, -2.0, 1.2, 1.0), ArmVector(1.0, 2.0, -3.2, 2.6, 4.0)}) {
      MobileManipulatorParameters parameters = without_grip(without_joint_friction(starting_at(start)));
      parameters.gear.damping_ratio = 0;
      MobileManipulator robot(held ? base_held(parameters) : parameters);
      const double start_J = energy_J(robot);
      for (int n = 0; n < 30; ++n) {  // then it meets end stop or floor
        robot.advance(Commands{}, false, 10ms);
        // Less than a thousandth of the energy converted from height to motion. The constant part: the gears
        // bend when the arm is released, and a semi-implicit step samples such an oscillation at the wrong
        // phase.
        ASSERT_NEAR(energy_J(robot), start_J, 5e-4 + 1e-3 * robot.kinetic_energy_J()) << 10 * n << " ms";
      }
      EXPECT_GT(robot.kinetic_energy_J(), 1.0);
    }
}

TEST(MobileManipulator, AnUnpoweredArmOnlyLosesEnergyAlsoAtEndStopsAndFloor) {
  // The floor takes nothing for good.
  MobileManipulator robot(without_joint_friction(starting_at({2.0, 1.6, -2.0, 1.2, 1.0})),
                          {.floor = {.stiffness_N_per_m = 1e5, .loss_s_per_m = 0, .friction = 0}});
  double lowest_J = energy_J(robot);
  const double start_J = lowest_J;
  bool touched = false;
  for (int ms = 0; ms < 4000; ++ms) {
    robot.advance(Commands{}, false, 1ms);
    if (robot.contact_force_W_N().norm() > 0) {  // it is going to give back what it has
      touched = true;
      continue;
    }
    const double now_J = energy_J(robot);
    // Wheels and rollers store energy that is not counted here: presliding, 4·½·(0.13 N·m)²/250 N·m, and
    // grip.
    ASSERT_LE(now_J, lowest_J + 1e-3) << ms << " ms";
    lowest_J = std::min(lowest_J, now_J);
  }
  EXPECT_TRUE(touched);
  EXPECT_LT(lowest_J, start_J - 3);
}

TEST(MobileManipulator, ATetherGivesBackWhatItTakesEvenIfTheModelIsHeldForLong) {
  MobileManipulatorParameters parameters = base_held(without_joint_friction(starting_at(kElbowUp)));
  parameters.gear.damping_ratio = 0;
  parameters.model_hold = 4ms;
  const sim::TetherSpring spring{
      .p_W_m = MobileManipulator(parameters).X_WT().translation() + Vector3d(0, 0.01, 0.01),
      .stiffness_N_per_m = 1e4};
  MobileManipulator robot(parameters, {.spring = spring});
  const auto all_J = [&] {
    return energy_J(robot) +
           0.5 * spring.stiffness_N_per_m * (spring.p_W_m - robot.X_WT().translation()).squaredNorm();
  };
  const double start_J = all_J();
  double fastest_J = 0;
  for (int n = 0; n < 500; ++n) {
    robot.advance(Commands{}, false, 1ms);
    fastest_J = std::max(fastest_J, robot.kinetic_energy_J());
    ASSERT_NEAR(all_J(), start_J, 0.05) << n << " ms";
  }
  EXPECT_GT(fastest_J, 0.5);
}

TEST(MobileManipulator, MotorsPutIntoTheArmWhatItHasAfterwards) {
  MobileManipulatorParameters parameters = base_held(without_joint_friction(starting_at(kCandle)));
  parameters.gear.damping_ratio = 0.02;
  MobileManipulator robot(parameters);
  const double before_J = energy_J(robot);
  robot.advance(torques({1.0, 0.8, -0.3, 0.1, 0.02}), true, 400ms);
  const double gain_J = energy_J(robot) - before_J;
  ASSERT_GT(robot.arm_motor_work_J(), 0.2);
  EXPECT_NEAR(gain_J, robot.arm_motor_work_J(), 0.01 * gain_J);
}

TEST(MobileManipulator, OnIceTheBaseRecoilsFromTheArmAndMomentumStaysZero) {
  const MobileManipulatorParameters parameters = without_grip(without_joint_friction(starting_at(kAhead)));
  MobileManipulator robot(parameters);
  RobotModel model(parameters.masses);
  robot.advance(torques({3, -12, -5, -1, 0.2}), true, 300ms);
  model.update(chain(robot));
  const ChainVector momentum = model.mass() * robot.velocity();
  const ChainVector of_one_axis = model.mass().diagonal().cwiseProduct(robot.velocity().cwiseAbs());
  ASSERT_GT(of_one_axis.head<3>().minCoeff(), 0.02);
  EXPECT_LT(momentum.head<3>().cwiseAbs().maxCoeff(), 2e-3 * of_one_axis.head<3>().maxCoeff());
  // Joint 1 turns clockwise, so the base turns counter-clockwise.
  EXPECT_GT(robot.arm_rad()[0], kAhead[0] + 0.01);
  EXPECT_GT(robot.pose().yaw_rad, 1e-3);
}

TEST(MobileManipulator, WithItsWheelsOnBlocksTheBaseStays) {
  MobileManipulator robot(base_held(starting_at(kAhead)));
  Commands commands = torques({5, -10, -3, 1, 0});
  for (std::size_t i = 0; i < 4; ++i) commands[i] = JointCommand::torque_Nm(i == 0 ? 0.5 : 0.0);
  robot.push_tip({30, 30, 0});
  robot.advance(commands, true, 500ms);
  EXPECT_EQ(robot.pose().x_m, 0.0);
  EXPECT_EQ(robot.pose().y_m, 0.0);
  EXPECT_EQ(robot.pose().yaw_rad, 0.0);
  EXPECT_GT(robot.wheel(0).position_rad(), 0.5);
  EXPECT_EQ(robot.wheel(1).position_rad(), 0.0);
}

TEST(MobileManipulator, DrivesAsTheBaseAloneDoes) {
  // Straight ahead with the arm straight up: a mass on wheels.
  const MobileManipulatorParameters parameters = starting_at(kCandle);
  MobileManipulator robot(parameters);
  sim::BaseParameters alone;
  alone.mass_kg = RobotModel(parameters.masses).total_mass_kg();
  sim::Base base(alone);
  Commands commands = positions(kCandle);
  for (std::size_t i = 0; i < 4; ++i) commands[i] = JointCommand::torque_Nm(i % 2 ? 0.25 : -0.25);
  for (int ms = 0; ms < 2000; ++ms) {
    robot.advance(commands, true, 1ms);
    base.advance(std::span(commands).first<4>(), true, 1ms);
  }
  ASSERT_GT(base.pose().x_m, 0.1);
  EXPECT_NEAR(robot.pose().x_m, base.pose().x_m, 0.02 * base.pose().x_m);
  EXPECT_NEAR(robot.twist()[0], base.twist()[0], 0.02 * base.twist()[0]);
}

TEST(MobileManipulator, TurnedToTheLeftItDrivesToTheLeft) {
  MobileManipulator robot(starting_at(kCandle));
  Commands commands = positions(kCandle);
  const auto drive = [&](std::array<double, 4> rad_per_s, std::chrono::milliseconds duration) {
    for (std::size_t i = 0; i < 4; ++i) commands[i] = JointCommand::velocity_rad_per_s(rad_per_s[i]);
    robot.advance(commands, true, duration);
  };
  for (int n = 0; n < 40 && robot.pose().yaw_rad < std::numbers::pi / 2; ++n) drive({4, 4, 4, 4}, 100ms);
  drive({0, 0, 0, 0}, 1s);
  const control::PlanarPose before = robot.pose();
  ASSERT_NEAR(before.yaw_rad, std::numbers::pi / 2, 0.1);
  drive({-4, 4, -4, 4}, 2s);
  const double x_m = robot.pose().x_m - before.x_m, y_m = robot.pose().y_m - before.y_m;
  ASSERT_GT(std::hypot(x_m, y_m), 0.2);
  EXPECT_NEAR(std::atan2(y_m, x_m), before.yaw_rad, 0.05);
  // Its velocity in B is that of rolling wheels.
  EXPECT_NEAR(robot.twist()[0], 4 * 0.0475, 0.01);
  EXPECT_NEAR(robot.twist()[1], 0.0, 0.01);
}

TEST(MobileManipulator, APayloadWeighsOnTheJointsByItsLever) {
  const auto held_Nm = [](double payload_kg) {
    MobileManipulatorParameters parameters = base_held(without_joint_friction(starting_at(kAhead)));
    parameters.masses.payload_kg = payload_kg;
    MobileManipulator robot(parameters);
    robot.advance(positions(kAhead), true, 4s);
    std::array<hal::JointSample, 9> samples;
    ArmVector sum_Nm = ArmVector::Zero();
    for (int n = 0; n < 1000; ++n) {
      robot.advance(positions(kAhead), true, 1ms);
      robot.measure(samples);
      for (int i = 0; i < 5; ++i) sum_Nm[i] += samples[static_cast<std::size_t>(4 + i)].torque_Nm / 1000;
    }
    return sum_Nm;
  };
  const ArmVector payload_Nm = held_Nm(0.5) - held_Nm(0);
  // Joint 2 is 0.2 m ahead of the base's middle, joint 3 by 0.155 m and joint 4 by 0.135 m along the arm.
  const double weight_N = 0.5 * kGravity_m_per_s2;
  const double lever_2_m = MobileManipulator(starting_at(kAhead)).X_WT().translation().x() - 0.2;
  const double lever_3_m = lever_2_m - 0.155 * std::cos(degrees(10));
  const double lever_4_m = lever_3_m - 0.135 * std::cos(degrees(10));
  EXPECT_NEAR(payload_Nm[0], 0.0, 0.01);
  EXPECT_NEAR(payload_Nm[1], -weight_N * lever_2_m, 0.01);
  EXPECT_NEAR(payload_Nm[2], -weight_N * lever_3_m, 0.01);
  EXPECT_NEAR(payload_Nm[3], -weight_N * lever_4_m, 0.01);
  EXPECT_NEAR(payload_Nm[4], 0.0, 0.01);
}

TEST(MobileManipulator, AGearBendsUnderTheWeightAndTheJointDoesNotSeeIt) {
  MobileManipulator robot(base_held(without_joint_friction(as_described(starting_at(kAhead)))));
  robot.advance(positions(kAhead), true, 4s);
  RobotModel model;
  model.update(chain(robot));
  std::array<hal::JointSample, 9> samples;
  robot.measure(samples);
  for (int i = 1; i < 4; ++i)
    EXPECT_NEAR(robot.arm_rad()[i] - samples[static_cast<std::size_t>(4 + i)].position_rad,
                -model.gravity_Nm()[3 + i] / 2500, 1e-4)
        << "joint " << i + 1;
}

TEST(MobileManipulator, CommandedToStandItHoldsItsArm) {
  MobileManipulator robot(starting_at(kAhead));
  robot.advance(standing(), true, 3s);
  // The controller's integral has to take up 8 N·m at 200 N·m/rad first.
  EXPECT_LT((robot.arm_rad() - kAhead).cwiseAbs().maxCoeff(), 0.06);
  const ArmVector before_rad = robot.arm_rad();
  robot.advance(standing(), true, 3s);
  EXPECT_LT((robot.arm_rad() - before_rad).cwiseAbs().maxCoeff(), 1e-3);
  EXPECT_LT(std::abs(robot.pose().x_m) + std::abs(robot.pose().y_m), 1e-3);
}

TEST(MobileManipulator, TorquesThatCarryTheDescribedRobotHoldTheBuiltOneByItsFriction) {
  for (const ArmVector& start : {kAhead, kElbowUp}) {
    MobileManipulator robot(starting_at(start));
    RobotModel model;
    for (int ms = 0; ms < 3000; ++ms) robot.advance(torques(carrying(model, robot)), true, 1ms);
    const ArmVector before_rad = robot.arm_rad();
    EXPECT_LT((before_rad - start).cwiseAbs().maxCoeff(), 0.01) << before_rad.transpose();
    for (int ms = 0; ms < 2000; ++ms) robot.advance(torques(carrying(model, robot)), true, 1ms);
    EXPECT_LT((robot.arm_rad() - before_rad).cwiseAbs().maxCoeff(), 1e-4);

    // And only by its friction.
    MobileManipulator smooth(without_joint_friction(starting_at(start)));
    for (int ms = 0; ms < 1000; ++ms) smooth.advance(torques(carrying(model, smooth)), true, 1ms);
    EXPECT_GT((smooth.arm_rad() - start).cwiseAbs().maxCoeff(), 0.05);
  }
}

TEST(MobileManipulator, TorquesThatCarryItExactlyHoldItWithoutFriction) {
  const MobileManipulatorParameters parameters = base_held(without_joint_friction(starting_at(kElbowUp)));
  MobileManipulator robot(parameters);
  RobotModel model(parameters.masses);
  for (int ms = 0; ms < 500; ++ms) robot.advance(torques(carrying(model, robot)), true, 1ms);
  EXPECT_LT((robot.arm_rad() - kElbowUp).cwiseAbs().maxCoeff(), 0.02);
}

TEST(MobileManipulator, APushBelowBreakAwayMovesNothingAndOneAboveDoes) {
  for (const Vector3d& direction : {Vector3d(1, 0, 0), Vector3d(-1, 0, 0)}) {
    MobileManipulator robot(starting_at(kCandle));  // carries itself
    for (int n = 1; n <= 100; ++n) {                // leaned on, not struck
      robot.push_tip(n / 100.0 * direction);
      robot.advance(Commands{}, false, 10ms);
    }
    robot.advance(Commands{}, false, 4s);
    const ArmVector before_rad = robot.arm_rad();
    const control::PlanarPose before = robot.pose();
    robot.advance(Commands{}, false, 4s);
    EXPECT_LT((robot.arm_rad() - before_rad).cwiseAbs().maxCoeff(), 1e-7);
    EXPECT_NEAR(robot.pose().x_m, before.x_m, 1e-8);
    EXPECT_LT((before_rad - kCandle).cwiseAbs().maxCoeff(), 2e-3);  // what friction and gears give

    robot.push_tip(4 * direction);
    robot.advance(Commands{}, false, 1s);
    EXPECT_GT((robot.arm_rad() - before_rad).cwiseAbs().maxCoeff(), 0.1);
  }
}

TEST(MobileManipulator, APushOnTheTipMovesItThatWay) {
  const MobileManipulatorParameters parameters = base_held(without_joint_friction(starting_at(kElbowUp)));
  for (const Vector3d& push_N : {Vector3d(20, 0, 0), Vector3d(0, 20, 0), Vector3d(0, 0, -20)}) {
    MobileManipulator robot(parameters);
    RobotModel model(parameters.masses);
    const Vector3d before_m = robot.X_WT().translation();
    robot.push_tip(push_N);
    for (int ms = 0; ms < 100; ++ms) robot.advance(torques(carrying(model, robot)), true, 1ms);
    EXPECT_GT((robot.X_WT().translation() - before_m).dot(push_N) / 20, 0.003) << push_N.transpose();
  }
}

TEST(MobileManipulator, PositionModeReachesItsTarget) {
  MobileManipulator robot;
  robot.advance(positions(kElbowUp), true, 6s);
  std::array<hal::JointSample, 9> samples;
  robot.measure(samples);
  for (int i = 0; i < 5; ++i)
    EXPECT_NEAR(samples[static_cast<std::size_t>(4 + i)].position_rad, kElbowUp[i], 0.003)
        << "joint " << i + 1;
  EXPECT_LT((robot.arm_rad() - kElbowUp).cwiseAbs().maxCoeff(), 0.006);
}

TEST(MobileManipulator, VelocityModeTurnsJointOneClockwiseAtTheCommandedSpeed) {
  MobileManipulator robot(starting_at(kElbowUp));
  Commands commands = standing();
  commands[4] = JointCommand::velocity_rad_per_s(0.5);
  robot.advance(commands, true, 1s);
  const double before_rad = robot.arm_rad()[0];
  const double side_m = robot.X_WT().translation().y();
  robot.advance(commands, true, 1s);
  EXPECT_NEAR(robot.arm_rad()[0] - before_rad, 0.5, 0.01);
  EXPECT_LT(robot.X_WT().translation().y(), side_m - 0.05);
}

/// Mean torque that joint 1, whose axis is vertical, takes at a constant speed.
double turning_Nm(double speed_rad_per_s) {
  MobileManipulator robot(base_held({}));
  Commands commands = standing();
  commands[4] = JointCommand::velocity_rad_per_s(speed_rad_per_s);
  robot.advance(commands, true, 2s);
  double sum_Nm = 0;
  constexpr int kSamples = 2000;
  std::array<hal::JointSample, 9> samples;
  for (int n = 0; n < kSamples; ++n) {
    robot.advance(commands, true, 1ms);
    robot.measure(samples);
    sum_Nm += samples[4].torque_Nm;
  }
  return sum_Nm / kSamples;
}

// A wheel's friction table holds its level below 0.3 rad/s, where an arm does most of its motion.
TEST(MobileManipulator, AJointsViscousFrictionShowsAtTheSpeedsOfAnArm) {
  const sim::bus::ArmJointData& joint = sim::bus::kArmJointData[0];
  // Noise of 2000 samples, and a resolution of the current's mA.
  for (const double speed : {0.05, 0.15, 0.25})
    EXPECT_NEAR(turning_Nm(speed), joint.coulomb_Nm + joint.viscous_Nm_s_per_rad * speed, 0.01) << speed;
}

TEST(MobileManipulator, ItsTipMovesAsItsVelocitySays) {
  MobileManipulator robot(starting_at(kElbowUp));
  Commands commands = torques({4, 6, -3, 1, 0.4});
  for (std::size_t i = 0; i < 4; ++i) commands[i] = JointCommand::torque_Nm(i % 2 ? 0.4 : -0.2);
  robot.advance(commands, true, 300ms);
  const Vector3d p_before_m = robot.X_WT().translation(), v_before = robot.v_WT_m_per_s();
  robot.advance(commands, true, 1ms);
  const Vector3d mean_m_per_s = (robot.X_WT().translation() - p_before_m) / 1e-3;
  ASSERT_GT(mean_m_per_s.norm(), 0.3);
  EXPECT_LT((mean_m_per_s - 0.5 * (v_before + robot.v_WT_m_per_s())).norm(), 1e-3 * mean_m_per_s.norm());
}

TEST(MobileManipulator, EndStopsAreWhereTheDescriptionHasThemAndHold) {
  const MobileManipulatorParameters parameters = starting_at(kCandle);
  const RobotModel model;
  for (std::size_t i = 0; i < 5; ++i) {
    EXPECT_NEAR(parameters.arm[i].lower_stop_rad, model.ranges()[i].lower_rad, 1e-9) << "joint " << i + 1;
    EXPECT_NEAR(parameters.arm[i].upper_stop_rad, model.ranges()[i].upper_rad, 1e-9) << "joint " << i + 1;
    for (const double sign : {-1.0, 1.0}) {
      MobileManipulator robot(base_held(parameters));
      Commands commands = standing();
      commands[4 + i] = JointCommand::velocity_rad_per_s(sign * 1.5);
      robot.advance(commands, true, 5s);
      const sim::bus::ArmJointData& joint = parameters.arm[i];
      // All the motor has: 15.7 N·m on 2e4 N·m/rad, and the links' weight.
      EXPECT_NEAR(robot.arm_rad()[static_cast<int>(i)],
                  sign > 0 ? joint.upper_stop_rad : joint.lower_stop_rad, 2e-3)
          << "joint " << i + 1;
    }
  }
}

/// A wall just in front of and below the end effector of the level arm.
EnvironmentParameters floor_under(const MobileManipulatorParameters& parameters, double gap_m) {
  EnvironmentParameters environment;
  const MobileManipulator robot(parameters);
  environment.walls = {
      {.p_W_m = robot.X_WT().translation() - Vector3d(0, 0, environment.tip_radius_m + gap_m)}};
  return environment;
}

TEST(MobileManipulator, TheTipPressesOnAWallWithWhatItsTorquesAmountTo) {
  // τ = g + Jᵀ·F: the wall has to give −F back.
  const MobileManipulatorParameters parameters = base_held(without_joint_friction(starting_at(kElbowUp)));
  MobileManipulator robot(parameters, floor_under(parameters, 0.0005));
  RobotModel model(parameters.masses);
  const Vector3d force_N(0, 0, -10);
  Vector3d sum_N = Vector3d::Zero();
  for (int ms = 0; ms < 4000; ++ms) {
    const ArmVector weight_Nm = carrying(model, robot);
    // Damped, because without friction nothing else damps the joints.
    const ArmVector damping_Nm = -ArmVector(4, 4, 2, 1, 0.3).cwiseProduct(robot.velocity().tail<5>());
    robot.advance(
        torques(weight_Nm + model.J_WT().topRows<3>().transpose().bottomRows<5>() * force_N + damping_Nm),
        true, 1ms);
    if (ms >= 3000) sum_N += robot.contact_force_W_N() / 1000;
  }
  EXPECT_NEAR(sum_N.z(), 10, 0.2);
  EXPECT_LT(sum_N.head<2>().norm(), 0.3 * sum_N.z());  // the cone of friction
}

TEST(MobileManipulator, AWallTakesAForceOnTheStandingRobotsEndEffector) {
  MobileManipulatorParameters parameters = starting_at(kCandle);
  EnvironmentParameters environment;
  const double tip_x_m = MobileManipulator(parameters).X_WT().translation().x();
  environment.walls = {{.p_W_m = {tip_x_m + environment.tip_radius_m, 0, 0}, .normal_W = -Vector3d::UnitX()}};
  MobileManipulator robot(parameters, environment);
  robot.push_tip({15, 0, 0});
  robot.advance(Commands{}, false, 3s);
  robot.advance(Commands{}, false, 100ms);
  // 15 N press the wall in by 0.75 mm; friction and bent gears of the joints carry a little of it.
  EXPECT_LT(robot.contact_force_W_N().x(), -13.5);
  EXPECT_GT(robot.contact_force_W_N().x(), -15.0);
  EXPECT_LT(robot.v_WT_m_per_s().norm(), 1e-5);
}

TEST(MobileManipulator, AWallIsNotPassedAtFullSpeed) {
  MobileManipulatorParameters parameters = starting_at(kElbowUp);
  EnvironmentParameters environment;
  // Joint 1 sweeps to the right (-y).
  environment.walls = {{.p_W_m = {0, -0.1, 0}, .normal_W = Vector3d::UnitY()}};
  MobileManipulator robot(parameters, environment);
  Commands commands = standing();
  commands[4] = JointCommand::velocity_rad_per_s(1.57);
  double hardest_N = 0, furthest_m = 0;
  for (int ms = 0; ms < 2000; ++ms) {
    robot.advance(commands, true, 1ms);
    hardest_N = std::max(hardest_N, robot.contact_force_W_N().norm());
    furthest_m = std::min(furthest_m, robot.X_WT().translation().y());
  }
  EXPECT_GT(hardest_N, 30);
  EXPECT_GT(furthest_m, -0.1);  // not deeper than the end effector's radius
  EXPECT_LT(furthest_m, -0.09);
}

TEST(MobileManipulator, DrivingItPushesABoxAlongATableAgainstItsFriction) {
  const MobileManipulatorParameters parameters = starting_at(kElbowUp);
  const Vector3d tip_m = MobileManipulator(parameters).X_WT().translation();
  EnvironmentParameters environment;
  environment.box = {{.block = {.centre_W_m = tip_m + Vector3d(0.08, 0, 0), .size_m = {0.1, 0.1, 0.1}}}};
  environment.tables = {{.centre_W_m = tip_m + Vector3d(0.2, 0, -0.1), .size_m = {0.6, 0.4, 0.1}}};
  MobileManipulator robot(parameters, environment);
  Commands commands = positions(kElbowUp);
  for (std::size_t i = 0; i < 4; ++i) commands[i] = JointCommand::velocity_rad_per_s(i % 2 ? 2 : -2);
  robot.advance(commands, true, 2500ms);
  const double box_x_m = robot.environment().box_p_W_m().x(), base_x_m = robot.pose().x_m;
  robot.advance(commands, true, 500ms);
  EXPECT_NEAR(robot.contact_force_W_N().x(), -0.3 * 0.5 * kGravity_m_per_s2, 0.05);
  ASSERT_GT(base_x_m, 0.1);
  EXPECT_NEAR(robot.environment().box_p_W_m().x() - box_x_m, robot.pose().x_m - base_x_m, 1e-3);
}

TEST(MobileManipulator, HalvingTheStepTwiceHardlyMovesTheEndOfADrivenManoeuvre) {
  const auto end_of = [](std::chrono::nanoseconds step) -> Vector3d {
    MobileManipulatorParameters parameters = starting_at(kElbowUp);
    for (sim::bus::ArmJointData& joint : parameters.arm) joint.axis.ticks_per_motor_rev = 1 << 30;
    parameters.wheels.drive.sensors = {0, 0, 0, 0, 0};
    parameters.step = step;
    MobileManipulator robot(parameters, floor_under(parameters, 0.02));
    for (int ms = 0; ms < 1500; ++ms) {
      const double t = 1e-3 * ms;
      Commands commands = torques({3 * std::sin(4 * t), 2 * std::sin(3 * t), std::sin(5 * t), 0.7, 0.3});
      for (std::size_t i = 0; i < 4; ++i) commands[i] = JointCommand::torque_Nm(i % 2 ? 0.25 : -0.2);
      robot.advance(commands, true, 1ms);
    }
    return robot.X_WT().translation();
  };
  const Vector3d start_m = MobileManipulator(starting_at(kElbowUp)).X_WT().translation();
  const Vector3d coarse_m = end_of(50us), fine_m = end_of(12500ns);
  ASSERT_GT((fine_m - start_m).norm(), 0.1);
  EXPECT_LT((coarse_m - fine_m).norm(), 1e-3);
}

TEST(MobileManipulator, HoldingTheModelHardlyMovesTheEndOfAFastSwing) {
  const auto end_of = [](std::chrono::nanoseconds hold) -> Vector3d {
    MobileManipulatorParameters parameters = without_joint_friction(starting_at({2.0, 1.6, -2.0, 1.2, 1.0}));
    parameters.model_hold = hold;
    MobileManipulator robot(parameters);
    robot.advance(torques({6, 2, -2, 0.5, 0.2}), true, 350ms);
    return robot.X_WT().translation();
  };
  const Vector3d start_m = MobileManipulator(starting_at({2.0, 1.6, -2.0, 1.2, 1.0})).X_WT().translation();
  const Vector3d each_step_m = end_of(50us);
  ASSERT_GT((each_step_m - start_m).norm(), 0.2);
  const double held_m = (end_of(500us) - each_step_m).norm();
  EXPECT_LT(held_m, 2e-5);
  // Of second order: four times the time, sixteen times the error.
  EXPECT_GT((end_of(2ms) - each_step_m).norm(), 8 * held_m);
}

TEST(MobileManipulator, JointsAreMeasuredWhereTheyAreAndAreHomed) {
  MobileManipulatorParameters parameters;
  MobileManipulator robot(parameters);
  ASSERT_EQ(robot.joint_count(), 9);
  std::array<hal::JointSample, 9> samples;
  robot.measure(samples);
  for (std::size_t i = 0; i < 9; ++i) {
    EXPECT_EQ(samples[i].homed, i >= 4);
    EXPECT_EQ(samples[i].fault, hal::JointFault::kNone);
    if (i >= 4) {
      EXPECT_EQ(samples[i].position_rad, parameters.start_rad[static_cast<int>(i) - 4]);
    }
  }
  robot.advance(positions({0.5, 0.5, -0.5, 0.5, 0.5}), true, 200ms);
  robot.measure(samples);
  for (int i = 0; i < 5; ++i) {
    const hal::JointSample& sample = samples[static_cast<std::size_t>(4 + i)];
    const double tick_rad =
        2 * std::numbers::pi / (4000 * parameters.arm[static_cast<std::size_t>(i)].axis.gear_ratio);
    EXPECT_NEAR(sample.position_rad, robot.joint(i).motor_rad(), tick_rad);
    EXPECT_NE(sample.position_rad, parameters.start_rad[i]);
  }
}

TEST(MobileManipulator, ItsDrivesTurnTheirRotorsAndTheLinksAreApart) {
  const MobileManipulator robot;
  constexpr std::array<double, 5> kGear{156, 156, 100, 71, 71};
  for (int i = 0; i < 5; ++i) {
    const double gear = kGear[static_cast<std::size_t>(i)];
    EXPECT_NEAR(robot.joint(i).drive().inertia_kg_m2(), 1.35e-5 * gear * gear, 1e-9) << "joint " << i + 1;
  }
}

TEST(MobileManipulator, EachJointHasNoiseOfItsOwn) {
  MobileManipulator robot(starting_at(kCandle));
  std::array<hal::JointSample, 9> samples;
  int equal = 0;
  for (int ms = 0; ms < 100; ++ms) {
    robot.advance(Commands{}, false, 1ms);
    robot.measure(samples);
    equal += samples[4].torque_Nm == samples[5].torque_Nm;  // equal motors and gears
  }
  EXPECT_LT(equal, 50);
}

TEST(MobileManipulator, IsNotQuiteTheRobotThatControlKnows) {
  RobotModel described, built(sim::built_robot());
  EXPECT_GT(std::abs(built.total_mass_kg() / described.total_mass_kg() - 1), 0.01);
  EXPECT_LT(std::abs(built.total_mass_kg() / described.total_mass_kg() - 1), 0.05);
  ChainVector q = ChainVector::Zero();
  q.tail<5>() = kAhead;
  described.update(q);
  built.update(q);
  const ArmVector difference_Nm = (built.gravity_Nm() - described.gravity_Nm()).tail<5>();
  EXPECT_GT(std::abs(difference_Nm[1]), 0.1);
  EXPECT_LT(std::abs(difference_Nm[1]), 1.0);
}

TEST(MobileManipulator, EqualSeedsRepeatARunToTheLastBit) {
  MobileManipulatorParameters other_seed = starting_at(kElbowUp);
  other_seed.wheels.noise_seed = 99;
  MobileManipulator a(starting_at(kElbowUp)), b(starting_at(kElbowUp)), c(other_seed);
  for (MobileManipulator* robot : {&a, &b, &c}) robot->advance(positions(kAhead), true, 1s);
  EXPECT_EQ(a.arm_rad(), b.arm_rad());
  EXPECT_EQ(a.X_WT().matrix(), b.X_WT().matrix());
  EXPECT_NE(a.arm_rad(), c.arm_rad());
}

TEST(MobileManipulator, DurationsOfAnyLengthPass) {
  const MobileManipulatorParameters parameters = base_held(without_joint_friction(starting_at(kElbowUp)));
  MobileManipulator whole(parameters), parts(parameters);
  for (int n = 0; n < 40; ++n) whole.advance(Commands{}, false, 2500us);
  for (int n = 0; n < 400; ++n) parts.advance(Commands{}, false, 250us);
  EXPECT_LT((whole.arm_rad() - parts.arm_rad()).norm(), 1e-6);
  whole.advance(Commands{}, false, 0ns);
  EXPECT_LT((whole.arm_rad() - parts.arm_rad()).norm(), 1e-6);
}

TEST(MobileManipulator, RefusesWhatMakesNoSenseByName) {
  const auto expect = [](const char* name, const auto& change) {
    MobileManipulatorParameters parameters;
    change(parameters);
    std::string refusal = "accepted";
    try {
      MobileManipulator{parameters};
    } catch (const std::invalid_argument& error) {
      refusal = error.what();
    }
    EXPECT_NE(refusal.find(name), std::string::npos) << name << ": " << refusal;
  };
  expect("accepted", [](MobileManipulatorParameters&) {});
  const double nan = std::numeric_limits<double>::quiet_NaN();
  expect("step", [](MobileManipulatorParameters& p) { p.step = 0ns; });
  expect("model_hold", [](MobileManipulatorParameters& p) { p.model_hold = -1us; });
  expect("step must be at most", [](MobileManipulatorParameters& p) { p.step = 400us; });
  expect("joint 5", [](MobileManipulatorParameters& p) { p.gear.stiffness_Nm_per_rad = 1e5; });
  expect("joint 3: start_rad", [](MobileManipulatorParameters& p) { p.start_rad[2] = 0.1; });
  expect("start_rad", [nan](MobileManipulatorParameters& p) { p.start_rad[4] = nan; });
  expect("stiffness_Nm_per_rad of the gear",
         [](MobileManipulatorParameters& p) { p.gear.stiffness_Nm_per_rad = 0; });
  expect("damping_ratio", [nan](MobileManipulatorParameters& p) { p.gear.damping_ratio = nan; });
  expect("coulomb_Nm", [](MobileManipulatorParameters& p) { p.arm[1].coulomb_Nm = -1; });
  expect("viscous", [](MobileManipulatorParameters& p) { p.arm[1].viscous_Nm_s_per_rad = -1; });
  expect("load_inertia", [](MobileManipulatorParameters& p) { p.arm[1].load_inertia_kg_m2 = -1; });
  expect("torque_constant",
         [](MobileManipulatorParameters& p) { p.arm[1].axis.torque_constant_Nm_per_A = 0; });
  expect("resistance", [](MobileManipulatorParameters& p) { p.arm[1].axis.winding_resistance_ohm = 0; });
  expect("gear_ratio", [](MobileManipulatorParameters& p) { p.arm[1].axis.gear_ratio = 0; });
  expect("roller_grip", [](MobileManipulatorParameters& p) { p.wheels.roller_grip = -1; });
  expect("mass_factor", [](MobileManipulatorParameters& p) { p.masses.links[3].mass_factor = 0; });
}

TEST(MobileManipulator, MeasureAndAdvanceDoNotAllocateOrLock) {
  if (!support::NoAllocGuard::kActive) GTEST_SKIP() << "the sanitizer owns malloc";
  MobileManipulator robot;
  std::array<hal::JointSample, 9> samples;
  const Commands commands = positions(kElbowUp);
  const support::NoAllocGuard guard;
  robot.advance(commands, true, 10ms);
  robot.measure(samples);
  EXPECT_EQ(guard.violations(), 0);
}

}  // namespace mobile_manipulator_test
