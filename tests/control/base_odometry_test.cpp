// The base's pose from wheel angles, against closed paths and the official driver's integration.
#include "control/base_odometry.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "tests/support/no_alloc_guard.h"

namespace base_odometry_test {

using control::BaseOdometry;
using control::LinkMap;
using control::PlanarPose;
using control::PlanarVector;
using control::WheelVector;
using std::numbers::pi;

const LinkMap& map() {
  static const LinkMap kMap = LinkMap::with_geometry({});
  return kMap;
}

void expect_pose(const PlanarPose& pose, double x_m, double y_m, double yaw_rad, double tolerance) {
  EXPECT_NEAR(pose.x_m, x_m, tolerance);
  EXPECT_NEAR(pose.y_m, y_m, tolerance);
  EXPECT_NEAR(pose.yaw_rad, yaw_rad, tolerance);
}

/// Turns the wheels as the displacement asks, in `steps` equal steps.
class Driver {
 public:
  explicit Driver(BaseOdometry& odometry) : odometry_(odometry) { odometry_.step(wheels_); }
  void drive(const PlanarVector& displacement_B, int steps) {
    for (int i = 0; i < steps; ++i) {
      wheels_ += map().wheel_velocity(displacement_B / steps);
      odometry_.step(wheels_);
    }
  }

 private:
  BaseOdometry& odometry_;
  WheelVector wheels_ = {123.0, -45.0, 6.0, -0.7};  // encoders start anywhere
};

/// The official driver's form (fact sheet 4.2): yaw first, then the increment turned by the new yaw.
PlanarPose official_odometry(const PlanarVector& displacement_B, int steps) {
  const double r_m = 0.0475, k_m = (0.47 + 0.30) / 2;
  const double X = displacement_B[0] / r_m / steps, Y = displacement_B[1] / r_m / steps;
  const double T = k_m * displacement_B[2] / r_m / steps;
  const double w1 = -X + Y + T, w2 = X + Y + T, w3 = -X - Y + T, w4 = X - Y + T;
  PlanarPose pose;
  for (int i = 0; i < steps; ++i) {
    pose.yaw_rad += r_m / 4 * (w1 + w2 + w3 + w4) / k_m;
    const double dx = r_m / 4 * (-w1 + w2 - w3 + w4), dy = r_m / 4 * (w1 + w2 - w3 - w4);
    pose.x_m += dx * std::cos(pose.yaw_rad) - dy * std::sin(pose.yaw_rad);
    pose.y_m += dx * std::sin(pose.yaw_rad) + dy * std::cos(pose.yaw_rad);
  }
  return pose;
}

TEST(BaseOdometry, StartsAtTheGivenPoseWhateverTheWheelAngles) {
  BaseOdometry odometry(map());
  expect_pose(odometry.step({1000, -1000, 3, 4}), 0, 0, 0, 0);
  expect_pose(odometry.step({1000, -1000, 3, 4}), 0, 0, 0, 0);
  odometry.reset({1, 2, 3});
  expect_pose(odometry.pose(), 1, 2, 3, 0);
  expect_pose(odometry.step({-7, 0, 0, 7}), 1, 2, 3, 0);
}

TEST(BaseOdometry, ForwardLeftAndTurnAreMeasuredInMetresAndRadians) {
  // One turn of each wheel, 2π·0.0475 m: by hand for the three pure motions.
  const double turn_m = 2 * pi * 0.0475;
  for (const auto& [wheels, pose] : {std::pair{WheelVector(-1, 1, -1, 1), PlanarPose{turn_m, 0, 0}},
                                     std::pair{WheelVector(1, 1, -1, -1), PlanarPose{0, turn_m, 0}},
                                     std::pair{WheelVector(1, 1, 1, 1), PlanarPose{0, 0, turn_m / 0.385}}}) {
    BaseOdometry odometry(map());
    odometry.step(WheelVector::Zero());
    expect_pose(odometry.step(2 * pi * wheels), pose.x_m, pose.y_m, pose.yaw_rad, 1e-14);
  }
}

TEST(BaseOdometry, ACircleClosesExactlyHoweverFewTheSamples) {
  for (const int steps : {3, 7, 1000}) {
    BaseOdometry odometry(map());
    Driver(odometry).drive({2 * pi * 0.4, 0, 2 * pi}, steps);
    expect_pose(odometry.pose(), 0, 0, 2 * pi, 1e-11);  // rounding of wheel angles of 100 rad
  }
}

TEST(BaseOdometry, ASquareCloses) {
  BaseOdometry odometry(map());
  Driver driver(odometry);
  for (int side = 0; side < 4; ++side) {
    driver.drive({1, 0, 0}, 10);
    driver.drive({0, 0, pi / 2}, 10);
  }
  expect_pose(odometry.pose(), 0, 0, 2 * pi, 1e-11);
}

TEST(BaseOdometry, TheOrderOfDrivingAndTurningMatters) {
  BaseOdometry forward_first(map());
  Driver a(forward_first);
  a.drive({1, 0, 0}, 1);
  a.drive({0, 0, pi / 2}, 1);
  expect_pose(forward_first.pose(), 1, 0, pi / 2, 1e-12);

  BaseOdometry turn_first(map());
  Driver b(turn_first);
  b.drive({0, 0, pi / 2}, 1);
  b.drive({1, 0, 0}, 1);
  expect_pose(turn_first.pose(), 0, 1, pi / 2, 1e-12);
}

TEST(BaseOdometry, WheelsThatOnlySlipAgainstEachOtherMoveNothing) {
  BaseOdometry odometry(map());
  odometry.step(WheelVector::Zero());
  expect_pose(odometry.step({5, -5, -5, 5}), 0, 0, 0, 1e-14);
}

TEST(BaseOdometry, TheOfficialDriversFormConvergesToItAsStepsShrink) {
  const PlanarVector displacement_B(1.0, 0.3, 1.5);
  BaseOdometry odometry(map());
  Driver(odometry).drive(displacement_B, 1);
  const auto error_m = [&](int steps) {
    const PlanarPose official = official_odometry(displacement_B, steps);
    return std::hypot(official.x_m - odometry.pose().x_m, official.y_m - odometry.pose().y_m);
  };
  // Half a step of yaw too far on the whole way: path · turn / (2·steps), and first order.
  const double path_m = std::hypot(odometry.pose().x_m, odometry.pose().y_m);
  EXPECT_NEAR(error_m(100), path_m * 1.5 / 200, 0.02 * path_m * 1.5 / 200);
  EXPECT_NEAR(error_m(100) / error_m(200), 2.0, 0.02);
  EXPECT_LT(error_m(1000000), 1e-6);
}

TEST(BaseOdometry, StepDoesNotAllocateOrLock) {
  if (!support::NoAllocGuard::kActive) GTEST_SKIP() << "the sanitizer owns malloc";
  BaseOdometry odometry(map());
  const support::NoAllocGuard guard;
  for (int i = 0; i < 10; ++i) odometry.step(WheelVector::Constant(i));
  EXPECT_EQ(guard.violations(), 0);
}

}  // namespace base_odometry_test
