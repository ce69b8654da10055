// The thesis' interpolation of the set-point (3.4.2), with its numbers and properties.
#include "control/setpoint_smoothing.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <random>
#include <stdexcept>
#include <string>

#include "tests/support/no_alloc_guard.h"

namespace setpoint_smoothing_test {

using control::SetpointSmoothing;
using control::TipSetpoint;
using Eigen::AngleAxisd;
using Eigen::Quaterniond;
using Eigen::Vector3d;

constexpr double kPi = std::numbers::pi;
constexpr double kDegree = kPi / 180;
/// The thesis', a millisecond.
constexpr double kStep_m = 2.5e-4;
constexpr double kThreshold_m = 5e-4;
constexpr double kTurn_rad = 0.01 * kDegree;
constexpr double kTurnThreshold_rad = 0.05 * kDegree;
constexpr double kNone = std::numeric_limits<double>::infinity();
const SetpointSmoothing::Config kThesis{.period_s = 1e-3,
                                        .speed_m_per_s = kStep_m / 1e-3,
                                        .threshold_m = kThreshold_m,
                                        .turn_speed_rad_per_s = kTurn_rad / 1e-3,
                                        .turn_threshold_rad = kTurnThreshold_rad,
                                        .acceleration_m_per_s2 = kNone,
                                        .jerk_m_per_s3 = kNone,
                                        .turn_acceleration_rad_per_s2 = kNone,
                                        .turn_jerk_rad_per_s3 = kNone,
                                        .velocity_cutoff_Hz = 5};

Quaterniond about(const Vector3d& axis, double angle_rad) {
  return Quaterniond(AngleAxisd(angle_rad, axis.normalized()));
}
Quaterniond opposite(const Quaterniond& q) { return {-q.w(), -q.x(), -q.y(), -q.z()}; }

/// At rest at the origin.
SetpointSmoothing thesis() {
  SetpointSmoothing smoothing(kThesis);
  smoothing.reset(Vector3d::Zero(), Quaterniond::Identity());
  return smoothing;
}

Vector3d first_step(const Vector3d& goal_m) { return thesis().step(goal_m, Quaterniond::Identity()).p_WT_m; }

TEST(SetpointSmoothing, ItsDefaultsAreTheThesisNumbers) {
  const SetpointSmoothing::Config config;
  EXPECT_DOUBLE_EQ(config.speed_m_per_s * config.period_s, kStep_m);
  EXPECT_DOUBLE_EQ(config.threshold_m, kThreshold_m);
  EXPECT_NEAR(config.turn_speed_rad_per_s * config.period_s, kTurn_rad, 1e-8);
  EXPECT_NEAR(config.turn_threshold_rad, kTurnThreshold_rad, 1e-7);
}

TEST(SetpointSmoothing, TheAxisThatIsFurthestOffGoesOneStepAndTheOthersTheirShare) {
  EXPECT_TRUE(first_step({0.1, 0, 0}).isApprox(Vector3d(kStep_m, 0, 0), 1e-12));
  EXPECT_TRUE(first_step({0.03, -0.1, 0.05}).isApprox(kStep_m * Vector3d(0.3, -1, 0.5), 1e-12));
  const Vector3d diagonal_m = first_step({-0.1, 0.1, -0.1});
  EXPECT_TRUE(diagonal_m.isApprox(kStep_m * Vector3d(-1, 1, -1), 1e-12));
  EXPECT_NEAR(diagonal_m.norm(), std::numbers::sqrt3 * kStep_m, 1e-15);
}

TEST(SetpointSmoothing, WhatIsNearerThanTheThresholdPasses) {
  const Vector3d direction = Vector3d(2, -1, 0.5).normalized();
  const Vector3d near_m = 0.999 * kThreshold_m * direction;
  EXPECT_EQ(first_step(near_m), near_m);
  const Vector3d far_m = 1.001 * kThreshold_m * direction;
  EXPECT_NEAR(first_step(far_m).x(), kStep_m, 1e-15);
}

TEST(SetpointSmoothing, TurnsBySlerpAHundredthOfADegreeACycle) {
  SetpointSmoothing smoothing = thesis();
  const Quaterniond goal = about({1, -2, 3}, 1.2);
  for (int n = 1; n <= 100; ++n) {
    const Quaterniond q = smoothing.step(Vector3d::Zero(), goal).q_WT;
    ASSERT_LT(q.angularDistance(about({1, -2, 3}, n * kTurn_rad)), 1e-9) << n;
  }
}

TEST(SetpointSmoothing, WhatIsTurnedLessThanTheThresholdPasses) {
  const Quaterniond near = about({0, 1, 1}, 0.999 * kTurnThreshold_rad);
  EXPECT_LT(thesis().step(Vector3d::Zero(), near).q_WT.angularDistance(near), 1e-12);
  const Quaterniond far = about({0, 1, 1}, 1.001 * kTurnThreshold_rad);
  EXPECT_NEAR(thesis().step(Vector3d::Zero(), far).q_WT.angularDistance(Quaterniond::Identity()), kTurn_rad,
              1e-9);
}

TEST(SetpointSmoothing, TurnsAlongTheShorterArcWhateverTheSign) {
  for (const double angle_rad : {350 * kDegree, -10 * kDegree})
    for (const bool flipped : {false, true}) {
      const Quaterniond goal = about(Vector3d::UnitZ(), angle_rad);
      SetpointSmoothing smoothing = thesis();
      EXPECT_LT(smoothing.step(Vector3d::Zero(), flipped ? opposite(goal) : goal)
                    .q_WT.angularDistance(about(Vector3d::UnitZ(), -kTurn_rad)),
                1e-9);
    }
}

TEST(SetpointSmoothing, TheOppositeQuaternionIsTheSameOrientation) {
  const Quaterniond here = about({1, 1, 0}, 0.8);
  SetpointSmoothing smoothing(kThesis);
  smoothing.reset(Vector3d::Zero(), here);
  for (int n = 0; n < 10; ++n)
    EXPECT_LT(smoothing.step(Vector3d::Zero(), opposite(here)).q_WT.angularDistance(here), 1e-12);
}

TEST(SetpointSmoothing, HalfATurnIsMadeEitherWayAndArrives) {
  for (const Vector3d& axis : {Vector3d(0, 0, 1), Vector3d(1, 0, 0), Vector3d(1, 2, -2)}) {
    SetpointSmoothing smoothing = thesis();
    const Quaterniond goal = about(axis, kPi);
    Quaterniond before = Quaterniond::Identity();
    // 180 degrees in hundredths of one, the last five in one.
    for (int n = 0; n < 18'000; ++n) {
      const Quaterniond q = smoothing.step(Vector3d::Zero(), goal).q_WT;
      ASSERT_LE(q.angularDistance(before), kTurnThreshold_rad + 1e-9);
      ASSERT_NEAR(q.norm(), 1, 1e-12);
      before = q;
    }
    EXPECT_LT(before.angularDistance(goal), 1e-9);
  }
}

TEST(SetpointSmoothing, NeitherStepsFurtherThanSaidNorPastItsGoal) {
  std::mt19937 random(5);
  std::uniform_real_distribution<double> any(-1, 1);
  const auto vector = [&](double size) {
    return Vector3d(Vector3d::NullaryExpr([&] { return size * any(random); }));
  };
  // The second's thresholds would let a step lead past its goal.
  SetpointSmoothing::Config eager = kThesis;
  eager.threshold_m = eager.turn_threshold_rad = 1e-9;
  eager.speed_m_per_s = 1;
  eager.turn_speed_rad_per_s = 2;
  for (const SetpointSmoothing::Config& config : {kThesis, eager}) {
    const double step_m = config.speed_m_per_s * config.period_s;
    const double turn_rad = config.turn_speed_rad_per_s * config.period_s;
    const double largest_m = std::max(config.threshold_m, std::numbers::sqrt3 * step_m);
    SetpointSmoothing smoothing(config);
    smoothing.reset(Vector3d::Zero(), Quaterniond::Identity());
    Vector3d goal_m = Vector3d::Zero();
    Quaterniond goal = Quaterniond::Identity();
    int arrivals = 0;
    for (int n = 0; n < 50'000; ++n) {
      if (n % 97 == 0) {
        goal_m = smoothing.setpoint().p_WT_m + vector(n % 2 == 0 ? 0.1 : 20 * step_m);
        goal = about(vector(1), any(random) * (n % 2 == 0 ? kPi : 20 * turn_rad)) * smoothing.setpoint().q_WT;
      }
      const TipSetpoint before = smoothing.setpoint();
      const TipSetpoint after = smoothing.step(goal_m, goal);
      const Vector3d way_m = after.p_WT_m - before.p_WT_m;
      ASSERT_LE(way_m.norm(), largest_m + 1e-12);
      if (after.p_WT_m != goal_m)
        ASSERT_NEAR(way_m.cwiseAbs().maxCoeff(), step_m, 1e-12);
      else
        ++arrivals;
      const Vector3d left_m = goal_m - after.p_WT_m;
      ASSERT_GE(left_m.dot(way_m), -1e-15) << "past its goal";
      ASSERT_LE(left_m.cross(way_m).norm(), 1e-12) << "off the straight line";
      const double turned_rad = before.q_WT.angularDistance(after.q_WT);
      const double off_rad = before.q_WT.angularDistance(goal);
      ASSERT_LE(turned_rad, std::max(config.turn_threshold_rad, turn_rad) + 1e-7);
      ASSERT_NEAR(after.q_WT.angularDistance(goal), off_rad - turned_rad, 1e-7) << "past its goal";
    }
    EXPECT_GT(arrivals, 1000);
  }
}

TEST(SetpointSmoothing, StartsAndStopsWithinAccelerationAndJerkAndNotPastItsGoal) {
  const SetpointSmoothing::Config config;
  SetpointSmoothing smoothing(config);
  smoothing.reset(Vector3d::Zero(), Quaterniond::Identity());
  const Vector3d goal_m(0.1, -0.05, 0);
  const Quaterniond goal = about({1, -2, 3}, 0.3);
  Vector3d velocity = Vector3d::Zero();
  Vector3d acceleration = Vector3d::Zero();
  int n = 0;
  for (; n < 3000 && (n == 0 || smoothing.limited()); ++n) {
    const TipSetpoint before = smoothing.setpoint();
    const TipSetpoint after = smoothing.step(goal_m, goal);
    const Vector3d velocity_now = (after.p_WT_m - before.p_WT_m) / config.period_s;
    const Vector3d acceleration_now = (velocity_now - velocity) / config.period_s;
    ASSERT_LE(acceleration_now.norm(), config.acceleration_m_per_s2 + 1e-6) << n;
    ASSERT_LE((acceleration_now - acceleration).norm() / config.period_s, config.jerk_m_per_s3 + 1e-3) << n;
    velocity = velocity_now;
    acceleration = acceleration_now;
    ASSERT_LT(after.p_WT_m.x(), goal_m.x() + 1e-5);
  }
  // 0.1 m at 0.25 m/s, and to speed up and brake; 0.3 rad at 0.1745 rad/s takes longer.
  EXPECT_GT(n, 1710);
  EXPECT_LT(n, 1800);
  EXPECT_LT((smoothing.setpoint().p_WT_m - goal_m).norm(), config.threshold_m);
  EXPECT_LT(smoothing.setpoint().q_WT.angularDistance(goal), config.turn_threshold_rad);
}

TEST(SetpointSmoothing, BrakesBeforeAWallAndNeverPassesIt) {
  SetpointSmoothing::Config config;
  config.walls_W_m.max().x() = 0.1;
  SetpointSmoothing smoothing(config);
  smoothing.reset(Vector3d::Zero(), Quaterniond::Identity());
  double velocity = 0;
  double hardest = 0;
  for (int n = 0; n < 2000; ++n) {
    const double before_m = smoothing.setpoint().p_WT_m.x();
    // A hand at 0.2 m/s, which continues beyond the workspace limit.
    const double after_m = smoothing.step({2e-4 * n, 0, 0}, Quaterniond::Identity()).p_WT_m.x();
    ASSERT_LE(after_m, 0.1);
    const double velocity_now = (after_m - before_m) / config.period_s;
    if (after_m < 0.0999) hardest = std::max(hardest, velocity - velocity_now);
    velocity = velocity_now;
  }
  EXPECT_NEAR(smoothing.setpoint().p_WT_m.x(), 0.1, 1e-6);
  EXPECT_LE(hardest, config.acceleration_m_per_s2 * config.period_s * 1.001);
  EXPECT_GT(hardest, 0.5 * config.acceleration_m_per_s2 * config.period_s);
}

TEST(SetpointSmoothing, ItsVelocityIsThatOfItsWayWithinTheFilter) {
  SetpointSmoothing smoothing = thesis();
  EXPECT_EQ(smoothing.setpoint().v_WT_W_m_per_s, Vector3d::Zero());
  const Vector3d goal_m(10, -5, 0);
  // A low-pass of 5 Hz has 1 − 1/e of a jump after 1/(2π·5 Hz) = 31.8 ms, in whole cycles within 1/63.
  for (int n = 0; n < 32; ++n) smoothing.step(goal_m, Quaterniond::Identity());
  EXPECT_NEAR(smoothing.setpoint().v_WT_W_m_per_s.x(), 0.25 * (1 - std::exp(-0.032 * 2 * kPi * 5)), 1e-9);
  for (int n = 0; n < 1000; ++n) smoothing.step(goal_m, Quaterniond::Identity());
  EXPECT_TRUE(smoothing.setpoint().v_WT_W_m_per_s.isApprox(Vector3d(0.25, -0.125, 0), 1e-9));
  const Vector3d here_m = smoothing.setpoint().p_WT_m;
  for (int n = 0; n < 1000; ++n) smoothing.step(here_m, Quaterniond::Identity());
  EXPECT_LT(smoothing.setpoint().v_WT_W_m_per_s.norm(), 1e-9);
}

TEST(SetpointSmoothing, ResetPutsItThereAtRest) {
  SetpointSmoothing smoothing = thesis();
  smoothing.step({1, 1, 1}, about({1, 0, 0}, 1));
  smoothing.reset({3, 2, 1}, Quaterniond(0, 2, 0, 0));
  EXPECT_EQ(smoothing.setpoint().p_WT_m, Vector3d(3, 2, 1));
  EXPECT_TRUE(smoothing.setpoint().q_WT.isApprox(Quaterniond(0, 1, 0, 0)));
  EXPECT_EQ(smoothing.setpoint().v_WT_W_m_per_s, Vector3d::Zero());
}

TEST(SetpointSmoothing, RefusesWhatIsNotPositiveByName) {
  using Config = SetpointSmoothing::Config;
  for (const double bad :
       {0.0, -1.0, std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity()})
    for (const auto& [name, member] :
         {std::pair{"period_s", &Config::period_s}, std::pair{" speed_m_per_s", &Config::speed_m_per_s},
          std::pair{" threshold_m", &Config::threshold_m},
          std::pair{"turn_speed_rad_per_s", &Config::turn_speed_rad_per_s},
          std::pair{"turn_threshold_rad", &Config::turn_threshold_rad},
          std::pair{"velocity_cutoff_Hz", &Config::velocity_cutoff_Hz}}) {
      Config config;
      config.*member = bad;
      try {
        const SetpointSmoothing smoothing(config);
        FAIL() << name << " = " << bad;
      } catch (const std::invalid_argument& error) {
        EXPECT_NE(std::string(error.what()).find(name), std::string::npos) << error.what();
      }
    }
}

TEST(SetpointSmoothing, StepDoesNotAllocateOrLock) {
  if (!support::NoAllocGuard::kActive) GTEST_SKIP() << "the sanitizer owns malloc";
  SetpointSmoothing smoothing = thesis();
  SetpointSmoothing limited{SetpointSmoothing::Config{}};
  const support::NoAllocGuard guard;
  smoothing.step({1, 2, 3}, Quaterniond(0, 0, 0, 1));
  limited.step({1, 2, 3}, Quaterniond(0, 0, 0, 1));
  EXPECT_EQ(guard.violations(), 0);
}

}  // namespace setpoint_smoothing_test
