// Limits of speed, acceleration and jerk of a set-point.
#include "control/setpoint_limiter.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <numbers>
#include <random>
#include <stdexcept>

#include "control/reference_limiter.h"

namespace setpoint_limiter_test {

using control::kBaseLimits;
using control::SetpointLimiter;
using control::SetpointLimits;
using Eigen::Vector2d;

constexpr double kPeriod_s = 1e-3;

/// Motion of a set-point, from its differences.
struct Motion {
  double speed = 0, acceleration = 0, jerk = 0;  ///< largest
  double behind = 0;                             ///< furthest from its target
  double past = 0;                               ///< furthest beyond x = `goal`
  double arrived_s = 0;                          ///< from then on it was where it should be
  int limited = 0;                               ///< cycles
};
Motion follow(const SetpointLimits& limits, const std::function<Vector2d(double)>& target, double duration_s,
              double goal = std::numeric_limits<double>::infinity()) {
  SetpointLimiter<2> limiter(limits);
  limiter.reset(target(0));
  Motion motion;
  Vector2d p = target(0);
  Vector2d v = Vector2d::Zero();
  Vector2d a = Vector2d::Zero();
  for (int n = 1; n * kPeriod_s < duration_s; ++n) {
    const Vector2d wanted = target(n * kPeriod_s);
    const Vector2d p_now = limiter.step(wanted, kPeriod_s, kPeriod_s);
    const Vector2d v_now = (p_now - p) / kPeriod_s;
    const Vector2d a_now = (v_now - v) / kPeriod_s;
    motion.speed = std::max(motion.speed, v_now.norm());
    motion.acceleration = std::max(motion.acceleration, a_now.norm());
    motion.jerk = std::max(motion.jerk, (a_now - a).norm() / kPeriod_s);
    p = p_now;
    v = v_now;
    a = a_now;
    motion.behind = std::max(motion.behind, (wanted - p).norm());
    motion.past = std::max(motion.past, p.x() - goal);
    if (limiter.limited()) motion.arrived_s = n * kPeriod_s;
    motion.limited += limiter.limited();
  }
  EXPECT_EQ(p, target(duration_s - kPeriod_s)) << "it is there in the end";
  return motion;
}

TEST(SetpointLimiter, AJumpIsFollowedAsFastAsTheLimitsAllowAndNotPassed) {
  const Motion jump = follow(
      kBaseLimits, [](double t) { return t > 0 ? Vector2d(0.6, 0.8) : Vector2d(0, 0); }, 3, 0.6);
  EXPECT_LE(jump.speed, kBaseLimits.speed + 1e-9);
  EXPECT_LE(jump.acceleration, kBaseLimits.acceleration + 1e-6);
  EXPECT_LE(jump.jerk, kBaseLimits.jerk + 200) << "a tenth of a micrometre is gone at once";
  EXPECT_LT(jump.past, 1e-5);
  // The shortest is s/v + v/a; braking takes seven tenths of the acceleration.
  const double least_s = 1 / kBaseLimits.speed + kBaseLimits.speed / kBaseLimits.acceleration;
  EXPECT_GT(jump.arrived_s, least_s);
  EXPECT_LT(jump.arrived_s, least_s + 0.15);
}

TEST(SetpointLimiter, ATargetThatStartsAtFullSpeedIsCaughtUpWithAndOneThatStopsIsReturnedTo) {
  const double speed = 0.3;
  const Motion start = follow(
      kBaseLimits, [&](double t) { return Vector2d(speed * t, 0); }, 2);
  // While it gets up to that speed, v²/2a.
  EXPECT_NEAR(start.behind, speed * speed / 2 / kBaseLimits.acceleration, 1e-3);
  EXPECT_LT(start.arrived_s, 0.5);
  const Motion stop = follow(
      kBaseLimits, [&](double t) { return Vector2d(speed * std::min(t, 1.0), 0); }, 3, speed);
  EXPECT_NEAR(stop.past, speed * speed / 2 / kBaseLimits.acceleration, 1e-3);
  EXPECT_LE(stop.acceleration, kBaseLimits.acceleration + 1e-6);
}

TEST(SetpointLimiter, WhatKeepsTheLimitsPassesUnchangedWhateverTheWakeUps) {
  SetpointLimiter<2> limiter(kBaseLimits);
  limiter.reset();
  std::mt19937 random(1);
  std::uniform_real_distribution<double> late_s(0, 0.7e-3);
  double last_s = 0;
  for (int n = 1; n < 10'000; ++n) {
    const double now_s = n * kPeriod_s + late_s(random);
    // 0.7 m/s and 1.4 m/s².
    const Vector2d target(0.35 * (1 - std::cos(2 * now_s)), 0);
    ASSERT_EQ(limiter.step(target, now_s - last_s, kPeriod_s), target);
    ASSERT_FALSE(limiter.limited()) << now_s;
    last_s = now_s;
  }
}

TEST(SetpointLimiter, LeavesWhatIsNotANumberForTheRobotToRefuse) {
  SetpointLimiter<1> limiter(kBaseLimits);
  limiter.reset();
  using Scalar = SetpointLimiter<1>::Vector;
  EXPECT_TRUE(std::isnan(
      limiter.step(Scalar::Constant(std::numeric_limits<double>::quiet_NaN()), kPeriod_s, kPeriod_s)[0]));
}

TEST(SetpointLimiter, RefusesALimitThatIsNone) {
  for (const double bad : {0.0, -1.0, std::numeric_limits<double>::infinity()}) {
    EXPECT_THROW(SetpointLimiter<2>({bad, 1, 1}), std::invalid_argument);
    EXPECT_THROW(SetpointLimiter<2>({1, bad, 1}), std::invalid_argument);
    EXPECT_THROW(SetpointLimiter<2>({1, 1, bad}), std::invalid_argument);
  }
}

/// libfranka's, at the speed of a youBot: top speed and top acceleration in the same times.
TEST(SetpointLimits, AreLibfrankasInProportionToTheSpeed) {
  const auto expect_scaled = [](const SetpointLimits& ours, const SetpointLimits& franka) {
    const double scale = ours.speed / franka.speed;
    EXPECT_NEAR(ours.acceleration, scale * franka.acceleration, 0.02 * ours.acceleration);
    EXPECT_NEAR(ours.jerk, scale * franka.jerk, 0.02 * ours.jerk);
  };
  expect_scaled(control::kTipLimits, {3.0, 9.0, 4500});
  expect_scaled(control::kTipTurnLimits, {2.5, 17, 8500});
  expect_scaled(control::kBaseLimits, {3.0, 9.0, 4500});
  expect_scaled(control::kBaseTurnLimits, {2.5, 17, 8500});
  // Slower than 0.6 of 10 rad/s², as the boards are: 2000 rpm a second behind a gear of 156.
  EXPECT_NEAR(control::kArmJointLimits.acceleration, 2000 * 2 * std::numbers::pi / 60 / 156, 0.01);
  EXPECT_NEAR(control::kArmJointLimits.jerk, 500 * control::kArmJointLimits.acceleration, 1);
}

TEST(ReferenceLimiter, AReferenceThatJumpsMovesAndItsVelocityIsThatOfItsWay) {
  control::ReferenceLimiter limiter{{}};
  limiter.reset({});
  control::BaseReference wanted;
  wanted.X_WB = {1, 0, 1};
  control::PlanarPose before;
  for (int n = 0; n < 200; ++n) {
    const control::BaseReference reference = limiter.step(wanted, kPeriod_s, kPeriod_s);
    ASSERT_TRUE(limiter.limited());
    ASSERT_NEAR(reference.twist_W[0], (reference.X_WB.x_m - before.x_m) / kPeriod_s, 1e-9);
    ASSERT_NEAR(reference.twist_W[2], (reference.X_WB.yaw_rad - before.yaw_rad) / kPeriod_s, 1e-9);
    before = reference.X_WB;
  }
  EXPECT_NEAR(before.x_m, 2.4 * 0.2 * 0.2 / 2, 1e-3);
  EXPECT_GT(before.yaw_rad, before.x_m) << "turns by itself";
}

}  // namespace setpoint_limiter_test
