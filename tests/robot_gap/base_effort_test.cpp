// Forces on a base, against numbers worked out by hand.
#include "identification/robot_gap/base_effort.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <string>
#include <utility>
#include <vector>

#include "identification/robot_gap/base_experiments.h"

namespace base_effort_test {

using control::BaseDescription;
using control::BaseKinematics;
using identification::robot_gap::BaseForces;
using identification::robot_gap::BaseMotion;
using identification::robot_gap::BaseRun;
using identification::robot_gap::effort_windows;
using identification::robot_gap::EffortWindow;

BaseDescription ten_kilograms() {
  BaseDescription base{.kinematics = BaseKinematics::kDifferential,
                       .wheels = {{"left", 0.05}, {"right", 0.05}},
                       .turning_length_m = 0.4};
  base.body.mass_kg = 10;
  base.body.yaw_inertia_kg_m2 = 0.3;
  return base;
}

/// Wheels at these speeds, without torque.
EffortWindow turning(double left_rad_per_s, double right_rad_per_s) {
  EffortWindow window;
  window.speed_rad_per_s = Eigen::Vector2d(left_rad_per_s, right_rad_per_s);
  window.speed_products = window.speed_rad_per_s * window.speed_rad_per_s.transpose();
  window.sign = window.speed_rad_per_s.cwiseSign();
  window.acceleration_rad_per_s2 = window.rolled_rad_per_s2 = Eigen::Vector2d::Zero();
  window.torque_Nm = Eigen::Vector2d::Zero();
  return window;
}

Eigen::Vector3d excess(const BaseDescription& base, const EffortWindow& window) {
  return BaseForces(base, base, -1).excess(window);
}

TEST(RestSpeeds, MotionIsNoNoise) {
  BaseMotion motion;
  for (const bool is_speed : {false, true}) {
    BaseRun run;
    run.is_speed = is_speed;
    run.angle_rad.resize(2, 800);
    for (Eigen::Index i = 0; i < 800; ++i) {
      const double t_s = 0.05 * static_cast<double>(i);
      run.time_s.push_back(t_s);
      // Turns to and fro at 0.5 Hz, with up to 4 rad/s of each wheel against the other.
      run.angle_rad.col(i) = Eigen::Vector2d(10 * t_s, 10 * t_s) +
                             4 / std::numbers::pi * std::sin(std::numbers::pi * t_s) * Eigen::Vector2d(-1, 1);
    }
    motion.runs = {run};
    const auto rest = identification::robot_gap::rest_speeds({&motion, 1}, ten_kilograms(), 0.15);
    EXPECT_NEAR(rest.twist[2], 0.02 * (2 * 4 * 0.05 / 0.4), 0.02 * 0.02);  // 2 % of 1 rad/s
    EXPECT_NEAR(rest.twist[0], 0.02 * 10 * 0.05, 1e-9);
  }
}

/// Wheels forward at 10 rad/s, the left ones with noise that is 0.025 rad/s of turning; the base turns to and
/// fro at 0.05 Hz.
BaseMotion turning_in_noise(double rad_per_s) {
  BaseRun run;
  run.angle_rad.resize(2, 2000);
  for (Eigen::Index i = 0; i < 2000; ++i) {
    const double t_s = 0.05 * static_cast<double>(i);
    run.time_s.push_back(t_s);
    const double turned_rad = rad_per_s * std::sin(0.1 * std::numbers::pi * t_s) / (0.1 * std::numbers::pi);
    run.angle_rad.col(i) = Eigen::Vector2d(10 * t_s, 10 * t_s) + 4 * turned_rad * Eigen::Vector2d(-1, 1);
    // A sine's standard deviation is 0.03/√2 rad: twice that of its differences over 0.15 s, by 0.05/0.4.
    run.angle_rad(0, i) += 0.03 * std::sin(static_cast<double>(7919 * i * i % 10007));
  }
  BaseMotion motion;
  motion.runs = {run};
  return motion;
}

double turning_rest(double rad_per_s) {
  const BaseMotion motion = turning_in_noise(rad_per_s);
  return identification::robot_gap::rest_speeds({&motion, 1}, ten_kilograms(), 0.15).twist[2];
}

TEST(RestSpeeds, NoiseRaisesThemToAtMostAStandstill) {
  EXPECT_NEAR(turning_rest(4), 0.02 * 4, 0.02 * 0.02 * 4);
  EXPECT_NEAR(turning_rest(1.6), 2 * 0.025, 0.1 * 0.05);
  EXPECT_NEAR(turning_rest(0.6), 0.05 * 0.6, 0.02 * 0.03);
}

TEST(RestSpeeds, AFewSecondsOfMotionAreADirection) {
  // One period of 20 s in 600 s: a thirtieth of the rows.
  BaseMotion motion = turning_in_noise(4);
  BaseRun& run = motion.runs[0];
  const Eigen::Vector2d turned(-1, 1);
  Eigen::MatrixXd angle_rad(2, 12000);
  for (Eigen::Index i = 0; i < angle_rad.cols(); ++i) {
    const double t_s = 0.05 * static_cast<double>(i);
    if (i >= 2000) run.time_s.push_back(t_s);
    const double turned_rad =
        i < 400 ? 4 * (1 - std::cos(0.1 * std::numbers::pi * t_s)) / (0.1 * std::numbers::pi) : 0;
    angle_rad.col(i) = Eigen::Vector2d(10 * t_s, 10 * t_s) + 4 * turned_rad * turned;
    angle_rad(0, i) += 0.03 * std::sin(static_cast<double>(7919 * i * i % 10007));
  }
  run.angle_rad = angle_rad;
  EXPECT_NEAR(identification::robot_gap::rest_speeds({&motion, 1}, ten_kilograms(), 0.15).twist[2], 0.02 * 4,
              0.02 * 0.02 * 4);
}

TEST(RestSpeeds, NoiseHasNoDirection) { EXPECT_EQ(turning_rest(0), std::numeric_limits<double>::infinity()); }

TEST(BaseForces, TorquesOverTheRadiusAccelerateTheMassAndTheWheels) {
  BaseDescription base = ten_kilograms();
  EffortWindow window = turning(4, 4);
  // 0.5 m/s²: 5 N, 0.125 N·m of each wheel
  window.acceleration_rad_per_s2 = window.rolled_rad_per_s2 = Eigen::Vector2d(10, 10);
  window.torque_Nm = Eigen::Vector2d(0.125, 0.125);
  EXPECT_NEAR(excess(base, window).head<1>().norm(), 0, 1e-12);
  for (BaseDescription::Wheel& wheel : base.wheels) {
    wheel.inertia_kg_m2 = 0.001;  // 0.01 N·m
    wheel.coulomb_Nm = 0.02;
    wheel.viscous_Nm_s_per_rad = 0.005;
  }
  window.torque_Nm = Eigen::Vector2d::Constant(0.125 + 0.01 + 0.02 + 0.02);
  EXPECT_NEAR(excess(base, window)[0], 0, 1e-12);
  EXPECT_NEAR(excess(base, window)[2], 0, 1e-12);
}

TEST(BaseForces, ACentreOfMassAheadPullsATurningBaseOutwards) {
  BaseDescription base = ten_kilograms();
  base.body.p_BC_m = {0.1, 0};
  // 1 m/s and 0.5 rad/s: the centre of mass needs m·c·r² = 0.25 N backwards and m·u·r = 5 N to the left at
  // 0.1 m.
  const Eigen::Vector3d left = excess(base, turning(18, 22));
  EXPECT_NEAR(left[0], 10 * 0.1 * 0.25, 1e-12);
  EXPECT_NEAR(left[2], -5 * 0.1, 1e-12);
}

TEST(BaseForces, ASlopePullsByTheHeading) {
  BaseDescription base = ten_kilograms();
  base.body.slope = {0, 0.02};
  EffortWindow window = turning(4, 4);
  EXPECT_NEAR(excess(base, window)[0], 0, 1e-12);
  window.cos_yaw = 0;  // looks along y
  window.sin_yaw = 1;
  EXPECT_NEAR(excess(base, window)[0], -10 * 9.81 * 0.02, 1e-12);
}

identification::robot_gap::SeenMotion seen_with(const BaseDescription& given) {
  return {.given = given,
          .speed_m_per_s = 0.5,
          .turn_rad_per_s = 0.5,
          .window_s = 1,
          .load = {},
          .noise_floor = {}};
}

// Of 2 kg more, the force forward shows 2 N while the base speeds up by 1 m/s² to 0.5 m/s.
TEST(BaseForces, SpeedingUpDecidesBetweenMassAndFriction) {
  const BaseDescription given = ten_kilograms();
  BaseDescription heavier = given;
  heavier.body.mass_kg += 2;
  const std::string text =
      identification::robot_gap::deciding_force(heavier, given, seen_with(given), {0.1, 0.1, 0.1});
  EXPECT_TRUE(text.starts_with("speeding up forward")) << text;
  EXPECT_NE(text.find("differ by 20 noise floors"), std::string::npos) << text;
  EXPECT_TRUE(identification::robot_gap::deciding_force(given, given, seen_with(given), {1, 1, 1})
                  .starts_with("none: "));
}

// A carpet that resists with 3 N more than it is given does so on the carpet only.
TEST(BaseForces, AFloorDecidesAboutItsResistance) {
  BaseDescription given = ten_kilograms();
  given.floors = {{"table"}, {"carpet"}};
  BaseDescription other = given;
  other.floors[1].resistance_N = 3;
  const std::string text =
      identification::robot_gap::deciding_force(other, given, seen_with(given), {0.1, 0.1, 0.1});
  EXPECT_TRUE(text.starts_with("steadily forward on carpet")) << text;
  EXPECT_NE(text.find("differ by 30 noise floors"), std::string::npos) << text;
}

// What slips drives the base less: by 10 % of the acceleration, 0.5 N of 5.
TEST(BaseForces, ABaseThatSlipsNeedsLess) {
  BaseDescription base = ten_kilograms();
  base.slip_forward = 0.1;
  EffortWindow window = turning(4, 4);
  window.acceleration_rad_per_s2 = window.rolled_rad_per_s2 = Eigen::Vector2d(10, 10);
  EXPECT_NEAR(excess(base, window)[0], -4.5, 1e-12);
}

TEST(BaseForces, WhatIsPushedCountsTheTorqueScaleOfTheGivenBase) {
  BaseDescription base = ten_kilograms();
  for (BaseDescription::Wheel& wheel : base.wheels) wheel.torque_scale = 2;
  EffortWindow window = turning(4, 4);
  window.torque_Nm = Eigen::Vector2d(0.1, 0.1);
  EXPECT_NEAR(BaseForces(base, base, -1).pushed(window)[0], 2 * 0.2 / 0.05, 1e-12);
  EXPECT_NEAR(BaseForces(base, base, -1).reported_torques(window)[0], 0, 1e-12);
}

/// Starts after a second at rest, then speeds up evenly.
BaseMotion speeding_up(double rad_per_s2, double torque_lag_s) {
  BaseRun run;
  constexpr Eigen::Index kRows = 400;
  run.angle_rad.resize(2, kRows);
  run.torque_Nm.resize(2, kRows);
  run.tracks.emplace_back();
  for (Eigen::Index i = 0; i < kRows; ++i) {
    const double t = 0.01 * static_cast<double>(i);
    run.time_s.push_back(t);
    run.angle_rad.col(i).setConstant(0.5 * rad_per_s2 * t * t);
    run.torque_Nm.col(i).setConstant(t - torque_lag_s);
    run.tracks.back().time_s.push_back(t);
    run.tracks.back().pose.push_back({t, 0, 0});
  }
  BaseMotion motion;
  motion.runs.push_back(std::move(run));
  return motion;
}

TEST(EffortWindows, AnAccelerationIsFromAnglesByPartsAndTheTorqueAtItsOwnTime) {
  const BaseMotion motion = speeding_up(3, 0.035);
  const auto windows =
      effort_windows(motion, ten_kilograms(), {Eigen::Vector2d(1, 1), {0.05, 0, 0.1}, 0.03}, 0.5, 0.035);
  ASSERT_GT(windows.size(), 5U);
  for (const EffortWindow& window : windows) {
    const double middle_s = 0.5 * (window.start_s + window.end_s);
    EXPECT_GT(window.start_s, 0.25);  // wheels turn at 1 rad/s after a third of a second
    EXPECT_NEAR(window.acceleration_rad_per_s2[0], 3, 1e-6);
    EXPECT_NEAR(window.speed_rad_per_s[1], 3 * middle_s, 1e-3);
    EXPECT_NEAR(window.torque_Nm[0], middle_s, 1e-5);
  }
}

/// Four wheels forward at 10 rad/s, each with noise of its own, and sideways to and fro.
BaseMotion mecanum_motion(double sideways_rad_per_s) {
  BaseRun run;
  constexpr Eigen::Index kRows = 4000;
  run.angle_rad.resize(4, kRows);
  run.torque_Nm = Eigen::MatrixXd::Zero(4, kRows);
  run.tracks.emplace_back();
  for (Eigen::Index i = 0; i < kRows; ++i) {
    const double t = 0.01 * static_cast<double>(i);
    run.time_s.push_back(t);
    const double sideways_rad = sideways_rad_per_s * std::sin(t);
    for (Eigen::Index w = 0; w < 4; ++w) {
      const double noise_rad = 0.003 * std::sin(static_cast<double>((7919 + 2 * w) * i * i % 10007));
      run.angle_rad(w, i) = (w % 2 == 0 ? -10 : 10) * t + (w < 2 ? 1 : -1) * sideways_rad + noise_rad;
    }
    run.tracks.back().time_s.push_back(t);
    run.tracks.back().pose.push_back({0.5 * t, 0, 0});
  }
  BaseMotion motion;
  motion.runs.push_back(std::move(run));
  return motion;
}

TEST(EffortWindows, SidewaysNoiseOfAMecanumBaseIsNoDirection) {
  BaseDescription base{.kinematics = BaseKinematics::kMecanum,
                       .wheels = {{"a", 0.05}, {"b", 0.05}, {"c", 0.05}, {"d", 0.05}},
                       .turning_length_m = 0.4};
  const auto largest_sign = [&](double sideways_rad_per_s) {
    const BaseMotion motion = mecanum_motion(sideways_rad_per_s);
    double largest = 0;
    for (const EffortWindow& window : effort_windows(
             motion, base, identification::robot_gap::rest_speeds({&motion, 1}, base, 0.03), 0.2, 0))
      largest = std::max(largest, std::abs(window.sideways_sign));
    return largest;
  };
  EXPECT_EQ(largest_sign(0), 0);
  EXPECT_GT(largest_sign(2), 0.9);
}

// The slip of a wheel by its load is as given: a wheel under a load of 2 loses 8 %.
TEST(EffortWindows, WhatAWheelLosesByItsLoadDoesNotMoveTheBase) {
  BaseMotion motion = speeding_up(3, 0);
  motion.runs[0].loaded_rad = 2 * motion.runs[0].angle_rad;
  BaseDescription base = ten_kilograms();
  base.slip_with_load = 0.04;
  const auto windows = effort_windows(motion, base, {Eigen::Vector2d(1, 1), {0.05, 0, 0.1}, 0.03}, 0.5, 0);
  ASSERT_GT(windows.size(), 5U);
  EXPECT_NEAR(windows[3].acceleration_rad_per_s2[0], 3, 1e-6);
  EXPECT_NEAR(windows[3].rolled_rad_per_s2[0], 2.76, 1e-6);
  EXPECT_NEAR(excess(base, windows[3])[0] - excess(base,
                                                   [&] {
                                                     EffortWindow steady = windows[3];
                                                     steady.rolled_rad_per_s2.setZero();
                                                     return steady;
                                                   }())[0],
              -10 * 0.05 * 2.76, 1e-6);
}

}  // namespace base_effort_test
