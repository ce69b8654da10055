// Planned paths: where they lead, and that position, velocity, acceleration and limits agree.
#include "control/base_path.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <stdexcept>
#include <utility>
#include <vector>

#include "tests/support/no_alloc_guard.h"

namespace base_path_test {

using control::BasePath;
using control::BaseReference;
using control::PlanarPose;
using control::PlanarVector;
using control::rotated;
using std::numbers::pi;

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
constexpr double kInfinity = std::numeric_limits<double>::infinity();

const PlanarVector kForward(1, 0, 0);
const PlanarVector kLeft(0, 0.5, 0);
const PlanarVector kTurn(0, 0, pi / 2);
const PlanarVector kCircle(2 * pi * 0.4, 0, 2 * pi);
const PlanarVector kMixed(0.3, -0.2, -1.0);

constexpr BasePath::Limits kLimits{.speed_m_per_s = 0.2,
                                   .acceleration_m_per_s2 = 0.1,
                                   .turn_speed_rad_per_s = 0.5,
                                   .turn_acceleration_rad_per_s2 = 0.3};

BasePath::Plan plan(std::vector<PlanarVector> displacements_B, PlanarPose start = {}) {
  BasePath::Plan result;
  result.rest_s = 0.5;
  result.limits = kLimits;
  result.start = start;
  result.displacements_B = std::move(displacements_B);
  return result;
}

void expect_pose(const PlanarPose& pose, double x_m, double y_m, double yaw_rad, double tolerance = 1e-12) {
  EXPECT_NEAR(pose.x_m, x_m, tolerance);
  EXPECT_NEAR(pose.y_m, y_m, tolerance);
  EXPECT_NEAR(pose.yaw_rad, yaw_rad, tolerance);
}

PlanarVector vector(const PlanarPose& pose) { return {pose.x_m, pose.y_m, pose.yaw_rad}; }

/// Calls `see` with times of a fine grid over the whole path and a little beyond.
template <class See>
void walk(const BasePath& path, const See& see) {
  const double step_s = path.duration_s() / 20000;
  for (int i = -100; i <= 20100; ++i) see(i * step_s);
}

TEST(BasePath, EndsWhereTheDisplacementsLead) {
  expect_pose(BasePath(plan({kForward})).goal(), 1, 0, 0);
  expect_pose(BasePath(plan({kLeft})).goal(), 0, 0.5, 0);
  expect_pose(BasePath(plan({kTurn})).goal(), 0, 0, pi / 2);
  expect_pose(BasePath(plan({kForward, kLeft, kTurn})).goal(), 1, 0.5, pi / 2);
  // Each displacement counts in the frame where it starts: after the turn, ahead is W's y.
  expect_pose(BasePath(plan({kForward, kTurn, kForward})).goal(), 1, 1, pi / 2);
}

TEST(BasePath, ACircleReturnsToItsStartFacingTheSameWay) {
  const BasePath path(plan({kCircle}, {1, 2, 0.5}));
  expect_pose(path.goal(), 1, 2, 0.5 + 2 * pi);
  // Half way it is one diameter to the left of the start.
  const PlanarVector across = rotated({0, 0.8, 0}, 0.5);
  expect_pose(path.at(path.duration_s() - (path.duration_s() - 0.5) / 2).X_WB, 1 + across[0], 2 + across[1],
              0.5 + pi, 1e-9);
}

TEST(BasePath, TheCircleKeepsItsRadius) {
  const BasePath path(plan({kCircle}));
  walk(path, [&](double time_s) {
    const PlanarPose X = path.at(time_s).X_WB;
    ASSERT_NEAR(std::hypot(X.x_m, X.y_m - 0.4), 0.4, 1e-12) << time_s;
  });
}

TEST(BasePath, RestsAtBothEnds) {
  const BasePath path(plan({kForward, kCircle}, {0.1, 0.2, 0.3}));
  for (const double time_s : {-10.0, 0.0, 0.25, 0.499999}) {
    const BaseReference reference = path.at(time_s);
    expect_pose(reference.X_WB, 0.1, 0.2, 0.3, 0);
    EXPECT_EQ(reference.twist_W, PlanarVector::Zero());
    EXPECT_EQ(reference.acceleration_W, PlanarVector::Zero());
  }
  for (const double late_s : {0.0, 1e-9, 1.0, 1e6}) {
    const BaseReference reference = path.at(path.duration_s() + late_s);
    expect_pose(reference.X_WB, path.goal().x_m, path.goal().y_m, path.goal().yaw_rad, 0);
    EXPECT_EQ(reference.twist_W, PlanarVector::Zero());
    EXPECT_EQ(reference.acceleration_W, PlanarVector::Zero());
  }
}

TEST(BasePath, RestsBetweenDisplacementsAsLongAsAsked) {
  BasePath::Plan with_rest = plan({kForward, kLeft});
  with_rest.rest_s = 2.0;
  BasePath::Plan without = with_rest;
  without.rest_s = 0.0;
  const BasePath path(with_rest);
  const double moving_s = BasePath(without).duration_s();
  EXPECT_NEAR(path.duration_s(), moving_s + 2 * 2.0, 1e-12);
  const double forward_ends_s = 2.0 + BasePath(plan({kForward})).duration_s() - 0.5;
  for (const double time_s : {0.001, 1.0, 1.999}) {
    const BaseReference reference = path.at(forward_ends_s + time_s);
    expect_pose(reference.X_WB, 1, 0, 0);
    EXPECT_EQ(reference.twist_W, PlanarVector::Zero());
  }
  EXPECT_GT(path.at(forward_ends_s + 2.5).X_WB.y_m, 0);
}

TEST(BasePath, AnEmptyPathStaysAtItsStart) {
  const BasePath path(plan({}, {1, 2, 3}));
  EXPECT_EQ(path.duration_s(), 0.0);
  for (const double time_s : {-1.0, 0.0, 1.0}) expect_pose(path.at(time_s).X_WB, 1, 2, 3, 0);
}

TEST(BasePath, TwistIsTheDerivativeOfThePoseAndAccelerationThatOfTheTwist) {
  const BasePath path(plan({kForward, kTurn, kCircle, kMixed}, {0, 0, 0.7}));
  constexpr double kH_s = 1e-4;
  walk(path, [&](double time_s) {
    const BaseReference before = path.at(time_s - kH_s), now = path.at(time_s),
                        after = path.at(time_s + kH_s);
    const PlanarVector twist_W = (vector(after.X_WB) - vector(before.X_WB)) / (2 * kH_s);
    const PlanarVector acceleration_W = (after.twist_W - before.twist_W) / (2 * kH_s);
    // Central differences: h²/6 times the next but one derivative (below 10 here), and rounding of 1e-16/h.
    // Where a segment starts or ends the jerk jumps by up to 60·d/T³ = 1 m/s³: h/4 of that.
    ASSERT_LT((twist_W - now.twist_W).norm(), 1e-7) << time_s;
    ASSERT_LT((acceleration_W - now.acceleration_W).norm(), 1e-4) << time_s;
  });
}

TEST(BasePath, PositionVelocityAndAccelerationAreContinuous) {
  const BasePath path(plan({kForward, kLeft, kTurn, kCircle}));
  BaseReference last = path.at(-1);
  const double step_s = 1e-4;
  for (double time_s = 0; time_s < path.duration_s() + 1; time_s += step_s) {
    const BaseReference now = path.at(time_s);
    // Speeds stay below 0.6, accelerations below 0.4, jerks below 2 (each in its unit and per second).
    ASSERT_LT((vector(now.X_WB) - vector(last.X_WB)).norm(), 0.6 * step_s) << time_s;
    ASSERT_LT((now.twist_W - last.twist_W).norm(), 0.4 * step_s) << time_s;
    ASSERT_LT((now.acceleration_W - last.acceleration_W).norm(), 2 * step_s) << time_s;
    last = now;
  }
}

TEST(BasePath, NeitherSpeedNorAccelerationExceedsItsLimitAndOneIsReached) {
  for (const PlanarVector& displacement_B :
       {kForward, kLeft, kTurn, kCircle, kMixed, PlanarVector(0.05, 0, 0), PlanarVector(0, 0, 0.1),
        PlanarVector(-3, 4, 0.2)}) {
    const BasePath path(plan({displacement_B}));
    double speed = 0, acceleration = 0, turn_speed = 0, turn_acceleration = 0;
    walk(path, [&](double time_s) {
      const BaseReference reference = path.at(time_s);
      speed = std::max(speed, reference.twist_W.head<2>().norm());
      acceleration = std::max(acceleration, reference.acceleration_W.head<2>().norm());
      turn_speed = std::max(turn_speed, std::abs(reference.twist_W[2]));
      turn_acceleration = std::max(turn_acceleration, std::abs(reference.acceleration_W[2]));
    });
    const double shares[] = {speed / kLimits.speed_m_per_s, acceleration / kLimits.acceleration_m_per_s2,
                             turn_speed / kLimits.turn_speed_rad_per_s,
                             turn_acceleration / kLimits.turn_acceleration_rad_per_s2};
    const double largest = *std::max_element(std::begin(shares), std::end(shares));
    EXPECT_LE(largest, 1 + 1e-9) << displacement_B.transpose();
    // The shortest time that keeps all limits touches one; the grid may miss the peak by (1/20000)². Curves
    // may be planned a little slower than they could be driven.
    const bool curved = displacement_B[2] != 0 && displacement_B.head<2>().norm() > 0;
    EXPECT_GE(largest, curved ? 0.9 : 1 - 1e-6) << displacement_B.transpose();
  }
}

TEST(BasePath, ATightFastCircleKeepsTheAccelerationLimitWithItsCentripetalPart) {
  // At 0.2 m/s on a radius of 0.1 m the centripetal acceleration alone is 0.4 m/s².
  BasePath::Plan fast = plan({PlanarVector(2 * pi * 0.1, 0, 2 * pi)});
  fast.limits.turn_speed_rad_per_s = 10;
  fast.limits.turn_acceleration_rad_per_s2 = 10;
  const BasePath path(fast);
  double acceleration = 0;
  walk(path, [&](double time_s) {
    acceleration = std::max(acceleration, path.at(time_s).acceleration_W.head<2>().norm());
  });
  EXPECT_LE(acceleration, fast.limits.acceleration_m_per_s2 * (1 + 1e-9));
}

TEST(BasePath, DurationsAreThoseOfTheQuinticByHand) {
  // 10τ³ − 15τ⁴ + 6τ⁵ peaks at 15/8 in speed and 10/√3 in acceleration.
  EXPECT_NEAR(BasePath(plan({kForward})).duration_s(), 0.5 + 15.0 / 8 * 1.0 / 0.2, 1e-12);
  EXPECT_NEAR(BasePath(plan({PlanarVector(0.05, 0, 0)})).duration_s(),
              0.5 + std::sqrt(10 / std::sqrt(3.0) * 0.05 / 0.1), 1e-12);
  EXPECT_NEAR(BasePath(plan({kTurn})).duration_s(), 0.5 + 15.0 / 8 * (pi / 2) / 0.5, 1e-12);
}

TEST(BasePath, IsSymmetricInTime) {
  const BasePath path(plan({kForward}));
  const double middle_s = 0.5 + (path.duration_s() - 0.5) / 2;
  EXPECT_NEAR(path.at(middle_s).X_WB.x_m, 0.5, 1e-12);
  EXPECT_NEAR(path.at(middle_s).twist_W[0], 0.2, 1e-12);
  EXPECT_NEAR(path.at(middle_s).acceleration_W[0], 0.0, 1e-12);
  for (const double dt_s : {1.0, 2.5, 4.0}) {
    EXPECT_NEAR(path.at(middle_s + dt_s).X_WB.x_m, 1 - path.at(middle_s - dt_s).X_WB.x_m, 1e-12);
    EXPECT_NEAR(path.at(middle_s + dt_s).acceleration_W[0], -path.at(middle_s - dt_s).acceleration_W[0],
                1e-12);
  }
}

TEST(BasePath, RefusesPlansThatAreNotFiniteOrNotPositive) {
  for (const double bad : {0.0, -1.0, kNaN, kInfinity}) {
    for (double BasePath::Limits::*const limit :
         {&BasePath::Limits::speed_m_per_s, &BasePath::Limits::acceleration_m_per_s2,
          &BasePath::Limits::turn_speed_rad_per_s, &BasePath::Limits::turn_acceleration_rad_per_s2}) {
      BasePath::Plan with_bad_limit = plan({kForward});
      with_bad_limit.limits.*limit = bad;
      EXPECT_THROW(BasePath{with_bad_limit}, std::invalid_argument) << bad;
    }
  }
  EXPECT_THROW(BasePath(plan({kForward, PlanarVector::Zero()})), std::invalid_argument);
  EXPECT_THROW(BasePath(plan({PlanarVector(kNaN, 0, 0)})), std::invalid_argument);
  EXPECT_THROW(BasePath(plan({PlanarVector(0, kInfinity, 0)})), std::invalid_argument);
  for (const double bad : {-0.1, kNaN, kInfinity}) {
    BasePath::Plan with_bad_rest = plan({kForward});
    with_bad_rest.rest_s = bad;
    EXPECT_THROW(BasePath{with_bad_rest}, std::invalid_argument) << "rest " << bad;
  }
  EXPECT_THROW(BasePath(plan({kForward}, {kNaN, 0, 0})), std::invalid_argument) << "start";
}

TEST(BasePath, ReadingItDoesNotAllocateOrLock) {
  if (!support::NoAllocGuard::kActive) GTEST_SKIP() << "the sanitizer owns malloc";
  const BasePath path(plan({kForward, kCircle}));
  double sum = 0;
  const support::NoAllocGuard guard;
  for (int i = 0; i < 50; ++i) sum += path.at(i).X_WB.x_m;
  EXPECT_EQ(guard.violations(), 0);
  EXPECT_NE(sum, 0.0);
}

}  // namespace base_path_test
