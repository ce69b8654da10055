// A base rolls as its kinematics says: circles, squares and turns that are computed by hand.
#include "control/base_rolling.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <stdexcept>
#include <vector>

#include "control/link_map.h"

namespace base_rolling_test {

using control::BaseDescription;
using control::BaseKinematics;
using control::BaseRolling;
using control::PlanarVector;

constexpr double kPi = std::numbers::pi;
constexpr double kExact = 1e-12;

BaseDescription two_wheels() {
  return {.kinematics = BaseKinematics::kDifferential,
          .wheels = {{"left", 0.05}, {"right", 0.05}},
          .turning_length_m = 0.4};
}
BaseDescription three_wheels() {
  return {.kinematics = BaseKinematics::kOmni,
          .wheels = {{"a", 0.04, kPi / 3}, {"b", 0.04, kPi}, {"c", 0.04, 5 * kPi / 3}},
          .turning_length_m = 0.125};
}

PlanarVector moved(const BaseDescription& base, const std::vector<double>& angle_rad, double steering_rad = 0,
                   int floor = -1, const std::vector<double>& loaded_rad = {}) {
  return BaseRolling(base).displacement(
      {.angle_rad = angle_rad, .loaded_rad = loaded_rad, .steering_rad = steering_rad, .floor = floor});
}
void expect_near(const PlanarVector& one, const PlanarVector& other) {
  EXPECT_NEAR((one - other).norm(), 0, kExact) << one.transpose() << " is not " << other.transpose();
}

// The wheels of a circle of 1 m to the left roll on circles of 0.8 m and 1.2 m.
TEST(BaseRolling, ACircleOfTwoWheelsClosesAfterTheArcsOfBothWheels) {
  const PlanarVector arc = moved(two_wheels(), {2 * kPi * 0.8 / 0.05, 2 * kPi * 1.2 / 0.05});
  expect_near(arc, {2 * kPi, 0, 2 * kPi});
  const control::PlanarPose end = control::moved_by({}, arc);
  EXPECT_NEAR(std::hypot(end.x_m, end.y_m), 0, kExact);
}

TEST(BaseRolling, ATricycleTurnsAboutThePointThatItsAxlesMeetIn) {
  const BaseDescription tricycle{
      .kinematics = BaseKinematics::kTricycle, .wheels = {{"front", 0.1}}, .turning_length_m = 1.5};
  // Steered by atan(1.5/2), the rear axle turns about a point 2 m to its left, the front wheel on 2.5 m.
  const PlanarVector quarter = moved(tricycle, {2.5 * kPi / 2 / 0.1}, std::atan2(1.5, 2.0));
  expect_near(quarter, {2 * kPi / 2, 0, kPi / 2});
}

TEST(BaseRolling, AnOffsetOfTheSteeringIsAddedToItsAngle) {
  BaseDescription tricycle{
      .kinematics = BaseKinematics::kTricycle, .wheels = {{"front", 0.1}}, .turning_length_m = 1.5};
  const PlanarVector steered = moved(tricycle, {10}, 0.3);
  tricycle.steering_offset_rad = 0.1;
  expect_near(moved(tricycle, {10}, 0.2), steered);
}

// Published inverse kinematics of the Robotino: w1 = (−0.866 vx + 0.5 vy + 0.125 w)/0.04 and so on.
TEST(BaseRolling, AnOmniBaseHasThePublishedKinematicsOfTheRobotino) {
  const double s = std::sqrt(3) / 2;
  const double vx = 0.1;
  const double vy = -0.07;
  const double w = 0.4;
  const std::vector<double> wheels{(-s * vx + 0.5 * vy + 0.125 * w) / 0.04, (-vy + 0.125 * w) / 0.04,
                                   (s * vx + 0.5 * vy + 0.125 * w) / 0.04};
  expect_near(moved(three_wheels(), wheels), {vx, vy, w});
}

TEST(BaseRolling, AMecanumBaseRollsAsTheLinkMapOfTheYoubot) {
  const BaseDescription base{.kinematics = BaseKinematics::kMecanum,
                             .wheels = {{"fl", 0.05}, {"fr", 0.05}, {"rl", 0.05}, {"rr", 0.05}},
                             .turning_length_m = 0.385};
  const control::LinkMap map =
      control::LinkMap::with_geometry({.wheel_radius_m = 0.05, .wheelbase_m = 0.47, .track_m = 0.30});
  const control::WheelVector wheels(0.3, -1.1, 2.0, 0.4);
  expect_near(moved(base, {0.3, -1.1, 2.0, 0.4}), map.twist(wheels));
}

TEST(BaseRolling, TheWheelsForAMotionMakeThisMotion) {
  const PlanarVector turning(0.2, 0, 0.3);
  const PlanarVector any(0.2, -0.1, 0.3);
  for (const auto& [base, motion] : {std::pair{two_wheels(), turning}, std::pair{three_wheels(), any}})
    expect_near(moved(base, BaseRolling(base).wheels_for(motion).angle_rad), motion);
  const BaseDescription tricycle{.kinematics = BaseKinematics::kTricycle,
                                 .wheels = {{"front", 0.1}},
                                 .turning_length_m = 1.5,
                                 .steering_offset_rad = 0.05};
  for (const double forward_m : {0.2, -0.2}) {
    const BaseRolling::Turned turned = BaseRolling(tricycle).wheels_for({forward_m, 0, 0.1});
    expect_near(moved(tricycle, turned.angle_rad, turned.steering_rad), {forward_m, 0, 0.1});
  }
}

TEST(BaseRolling, SlipTakesItsShareOfEachDirection) {
  BaseDescription base = three_wheels();
  const std::vector<double> wheels = BaseRolling(base).wheels_for({0.2, 0.1, 0.5}).angle_rad;
  base.slip_forward = 0.1;
  base.slip_sideways = 0.2;
  base.floors = {{"smooth", 0}, {"carpet", 0.05}};
  expect_near(moved(base, wheels), {0.9 * 0.2, 0.8 * 0.1, 0.5});
  expect_near(moved(base, wheels, 0, 1), {0.85 * 0.2, 0.75 * 0.1, 0.95 * 0.5});
}

// 2 per unit of load, at loads of 0.01 and 0: the left wheel loses 2 %.
TEST(BaseRolling, AWheelLosesByItsOwnLoad) {
  BaseDescription base = two_wheels();
  base.slip_with_load = 2;
  const PlanarVector motion = moved(base, {10, 10}, 0, -1, {0.1, 0});
  expect_near(motion, {0.05 * (9.8 + 10) / 2, 0, 0.05 * 0.2 / 0.4});
}

TEST(BaseRolling, APointAheadOfATurningBaseMovesAcross) {
  BaseDescription base = two_wheels();
  base.tracking.p_BT_m = {0.3, 0};
  // A quarter turn on the spot: the point goes from (0.3, 0) to (0, 0.3).
  expect_near(BaseRolling(base).tracked({0, 0, kPi / 2}), {-0.3, 0.3, kPi / 2});
  // In the axes of a body that looks to the left.
  base.tracking.yaw_BT_rad = kPi / 2;
  expect_near(BaseRolling(base).tracked({0, 0, kPi / 2}), {0.3, 0.3, kPi / 2});
  base.tracking.scale = 2;
  expect_near(BaseRolling(base).tracked({0, 0, kPi / 2}), {0.6, 0.6, kPi / 2});
}

TEST(BaseRolling, WheelsThatDoNotDetermineAMotionAreRefused) {
  BaseDescription base = three_wheels();
  for (BaseDescription::Wheel& wheel : base.wheels) wheel.angle_rad = 1;
  EXPECT_THROW(BaseRolling{base}, std::invalid_argument);
  base = two_wheels();
  base.wheels.pop_back();
  EXPECT_THROW(BaseRolling{base}, std::invalid_argument);
}

}  // namespace base_rolling_test
