// Excitation of several joints by Fourier series.
#include "identification/experiments/fourier_motion.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>

namespace fourier_motion_test {
namespace {

using identification::experiments::filling;
using identification::experiments::FourierMotion;
using identification::experiments::MotionLimits;

constexpr Eigen::Index kJoints = 3;

FourierMotion random_motion(std::uint64_t seed) {
  std::mt19937_64 random(seed);
  std::normal_distribution<double> normal;
  FourierMotion motion{.period_s = 5, .duration_s = 20, .ramp_s = 2};
  motion.centre_rad.setLinSpaced(kJoints, -1, 1);
  motion.sine_rad = Eigen::MatrixXd::NullaryExpr(kJoints, 4, [&] { return normal(random); });
  motion.cosine_rad = Eigen::MatrixXd::NullaryExpr(kJoints, 4, [&] { return normal(random); });
  return motion;
}

MotionLimits limits(double reach_rad, double speed, double acceleration) {
  const Eigen::VectorXd centre = Eigen::VectorXd::LinSpaced(kJoints, -1, 1);
  return {centre.array() - reach_rad, centre.array() + 0.7 * reach_rad,
          Eigen::VectorXd::Constant(kJoints, speed), Eigen::VectorXd::Constant(kJoints, acceleration)};
}

TEST(FourierMotion, VelocityAndAccelerationAreTheDerivatives) {
  const FourierMotion motion = random_motion(1);
  constexpr double kStep_s = 1e-5;
  for (double t = 0.013; t < motion.duration_s; t += 0.037) {
    const auto before = motion.at(1, t - kStep_s);
    const auto now = motion.at(1, t);
    const auto after = motion.at(1, t + kStep_s);
    // Central differences: a third derivative of some 1000 rad/s³ times the square of the step, and rounding.
    EXPECT_NEAR(now.velocity_rad_per_s, (after.position_rad - before.position_rad) / (2 * kStep_s), 1e-6);
    EXPECT_NEAR(now.acceleration_rad_per_s2,
                (after.velocity_rad_per_s - before.velocity_rad_per_s) / (2 * kStep_s), 1e-5);
  }
}

TEST(FourierMotion, StartsAndEndsAtRestAtItsCentre) {
  const FourierMotion motion = random_motion(2);
  for (Eigen::Index joint = 0; joint < kJoints; ++joint)
    for (const double t : {-1.0, 0.0, 1e-6, motion.duration_s - 1e-6, motion.duration_s, 30.0}) {
      const auto state = motion.at(joint, t);
      EXPECT_NEAR(state.position_rad, motion.centre_rad[joint], 1e-12) << t;
      EXPECT_NEAR(state.velocity_rad_per_s, 0, 1e-9) << t;
      EXPECT_NEAR(state.acceleration_rad_per_s2, 0, 1e-3) << t;  // rises by at most 300 rad/s³
    }
}

TEST(FourierMotion, RepeatsBetweenItsRamps) {
  const FourierMotion motion = random_motion(3);
  for (double t = motion.ramp_s; t + motion.period_s <= motion.duration_s - motion.ramp_s; t += 0.1) {
    const auto now = motion.at(2, t);
    const auto later = motion.at(2, t + motion.period_s);
    EXPECT_NEAR(now.position_rad, later.position_rad, 1e-12);
    EXPECT_NEAR(now.velocity_rad_per_s, later.velocity_rad_per_s, 1e-11);
    EXPECT_NEAR(now.acceleration_rad_per_s2, later.acceleration_rad_per_s2, 1e-10);
  }
  // The first harmonic, by hand: a sine of 0.2 rad and 5 s, a quarter of a period after a whole one.
  FourierMotion sine = motion;
  sine.sine_rad.setZero();
  sine.cosine_rad.setZero();
  sine.sine_rad(0, 0) = 0.2;
  const double rate = 2 * std::numbers::pi / 5;
  EXPECT_NEAR(sine.at(0, 6.25).position_rad, -1 + 0.2, 1e-12);
  EXPECT_NEAR(sine.at(0, 5.0).velocity_rad_per_s, 0.2 * rate, 1e-12);
  EXPECT_NEAR(sine.at(0, 6.25).acceleration_rad_per_s2, -0.2 * rate * rate, 1e-12);
}

/// The largest share of a limit that a joint uses.
double used(const FourierMotion& motion, const MotionLimits& limits, Eigen::Index joint) {
  double most = 0;
  for (double t = 0; t < motion.duration_s; t += 1e-3) {
    const auto state = motion.at(joint, t);
    const double away = state.position_rad - motion.centre_rad[joint];
    most = std::max({most, away / (limits.upper_rad[joint] - motion.centre_rad[joint]),
                     away / (limits.lower_rad[joint] - motion.centre_rad[joint]),
                     std::abs(state.velocity_rad_per_s) / limits.speed_rad_per_s[joint],
                     std::abs(state.acceleration_rad_per_s2) / limits.acceleration_rad_per_s2[joint]});
  }
  return most;
}

TEST(FourierMotion, FillsTheLimitsThatItReachesFirst) {
  for (const MotionLimits& given : {limits(0.5, 100, 1000), limits(50, 1, 1000), limits(50, 100, 2)})
    for (Eigen::Index joint = 0; joint < kJoints; ++joint)
      EXPECT_NEAR(used(filling(random_motion(4), given), given, joint), 1, 2e-3);
}

TEST(FourierMotion, RestsWhereItHasNoRoom) {
  MotionLimits given = limits(0.5, 1, 1);
  given.upper_rad[1] = -0.2;  // the centre is at 0
  const FourierMotion motion = filling(random_motion(5), given);
  EXPECT_EQ(motion.sine_rad.row(1).norm() + motion.cosine_rad.row(1).norm(), 0);
  EXPECT_GT(motion.sine_rad.row(0).norm(), 0);
}

}  // namespace
}  // namespace fourier_motion_test
