// Displacements at constant twist, in the plane.
#include "control/planar.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

namespace planar_test {

using control::moved_by;
using control::PlanarPose;
using control::PlanarVector;
using control::rotated;
using std::numbers::pi;

constexpr double kRounding = 1e-14;  // of positions of about a metre

void expect_pose(const PlanarPose& pose, double x_m, double y_m, double yaw_rad,
                 double tolerance = kRounding) {
  EXPECT_NEAR(pose.x_m, x_m, tolerance);
  EXPECT_NEAR(pose.y_m, y_m, tolerance);
  EXPECT_NEAR(pose.yaw_rad, yaw_rad, tolerance);
}

TEST(MovedBy, StraightLinesFollowTheHeading) {
  expect_pose(moved_by({}, {1, 0, 0}), 1, 0, 0);
  expect_pose(moved_by({}, {0, 1, 0}), 0, 1, 0);
  expect_pose(moved_by({0, 0, pi / 2}, {1, 0, 0}), 0, 1, pi / 2);  // facing left: ahead is W's y
  expect_pose(moved_by({0, 0, pi / 2}, {0, 1, 0}), -1, 0, pi / 2);
  expect_pose(moved_by({3, 4, pi}, {1, 2, 0}), 2, 2, pi);
}

TEST(MovedBy, TurningOnTheSpotStaysThere) { expect_pose(moved_by({1, 2, 0.3}, {0, 0, -1.1}), 1, 2, -0.8); }

TEST(MovedBy, AFullCircleReturnsToItsStartFromAnyPose) {
  for (const double radius_m : {0.4, -0.4, 2.0})
    for (const double yaw_rad : {0.0, 1.0, -2.5})
      expect_pose(moved_by({0.5, -0.7, yaw_rad}, {2 * pi * radius_m, 0, 2 * pi}), 0.5, -0.7,
                  yaw_rad + 2 * pi);
}

TEST(MovedBy, AQuarterCircleToTheLeftEndsOneRadiusAheadAndOneToTheLeft) {
  expect_pose(moved_by({}, {pi / 2 * 0.4, 0, pi / 2}), 0.4, 0.4, pi / 2);
  expect_pose(moved_by({}, {pi / 2 * 0.4, 0, -pi / 2}), 0.4, -0.4, -pi / 2);  // to the right
  expect_pose(moved_by({}, {0, pi / 2 * 0.4, pi / 2}), -0.4, 0.4, pi / 2);    // leftwards, turning left
}

TEST(MovedBy, TwoHalvesMakeTheWhole) {
  const PlanarPose start{0.3, -0.2, 0.9};
  const PlanarVector displacement_B(0.7, -0.4, 1.7);
  const PlanarPose whole = moved_by(start, displacement_B);
  const PlanarPose halves = moved_by(moved_by(start, displacement_B / 2), displacement_B / 2);
  expect_pose(halves, whole.x_m, whole.y_m, whole.yaw_rad);
}

TEST(MovedBy, TheOppositeDisplacementUndoesIt) {
  const PlanarVector displacement_B(0.7, -0.4, 1.7);
  expect_pose(moved_by(moved_by({0.3, -0.2, 0.9}, displacement_B), -displacement_B), 0.3, -0.2, 0.9);
}

TEST(MovedBy, KeepsItsPrecisionForTheTurnsOfOneControlCycle) {
  // Against the power series of sin(t)/t and (1-cos t)/t, exact to 1e-17 for these t; tolerance: one
  // rounding.
  for (const double turn : {1e-3, 1e-5, 1e-8, 1e-12, 1e-200, 0.0, -1e-8, -1e-3})
    expect_pose(moved_by({}, {1, 0, turn}), 1 - turn * turn / 6 + turn * turn * turn * turn / 120,
                turn / 2 - turn * turn * turn / 24, turn, 3e-16);
}

TEST(MovedBy, YawIsNotWrapped) {
  PlanarPose pose;
  for (int i = 0; i < 8; ++i) pose = moved_by(pose, {0, 0, pi / 2});
  EXPECT_NEAR(pose.yaw_rad, 4 * pi, kRounding * 10);
}

TEST(Rotated, TurnsCounterClockwiseAndLeavesYawAlone) {
  EXPECT_TRUE(rotated({1, 0, 7}, pi / 2).isApprox(PlanarVector(0, 1, 7), kRounding));
  EXPECT_TRUE(rotated({0, 1, 7}, pi / 2).isApprox(PlanarVector(-1, 0, 7), kRounding));
  EXPECT_TRUE(rotated(rotated({0.3, -0.8, 1}, 0.7), -0.7).isApprox(PlanarVector(0.3, -0.8, 1), kRounding));
}

}  // namespace planar_test
