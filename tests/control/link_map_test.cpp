// The link map against the thesis' matrix, the official driver's formulas and the balance of power.
#include "control/link_map.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>
#include <stdexcept>

namespace link_map_test {

using control::BaseGeometry;
using control::LinkMap;
using control::PlanarVector;
using control::WheelSigns;
using control::WheelVector;

constexpr double kRounding = 1e-13;  // relative, of sums of four products

/// Deterministic arguments for statements about all of them.
class Any {
 public:
  WheelVector wheels() { return {value(), value(), value(), value()}; }
  PlanarVector planar() { return {value(), value(), value()}; }

 private:
  double value() { return uniform_(random_); }
  std::mt19937 random_{7};
  std::uniform_real_distribution<double> uniform_{-10, 10};
};

/// FourSwedishWheelOmniBaseKinematic of the official driver (fact sheet 4.2), slide ratio 1.
WheelVector official_wheel_velocity(const PlanarVector& twist, const BaseGeometry& g) {
  const double X = twist[0] / g.wheel_radius_m;
  const double Y = twist[1] / g.wheel_radius_m;
  const double theta = (g.wheelbase_m + g.track_m) / 2 * twist[2] / g.wheel_radius_m;
  return {-X + Y + theta, X + Y + theta, -X - Y + theta, X - Y + theta};
}
PlanarVector official_twist(const WheelVector& w, const BaseGeometry& g) {
  const double quarter_m = g.wheel_radius_m / 4;
  const double k_m = (g.wheelbase_m + g.track_m) / 2;
  return {quarter_m * (-w[0] + w[1] - w[2] + w[3]), quarter_m * (w[0] + w[1] - w[2] - w[3]),
          quarter_m * (w[0] + w[1] + w[2] + w[3]) / k_m};
}

TEST(LinkMap, WithoutGeometryIsTheMatrixOfTheThesis) {
  const LinkMap map = LinkMap::without_geometry();
  // Columns of [yaw; vx; vy] = [[1 1 1 1]; [-1 1 -1 1]; [1 1 -1 -1]] in the order x, y, yaw.
  EXPECT_EQ(map.twist({1, 0, 0, 0}), PlanarVector(-1, 1, 1));
  EXPECT_EQ(map.twist({0, 1, 0, 0}), PlanarVector(1, 1, 1));
  EXPECT_EQ(map.twist({0, 0, 1, 0}), PlanarVector(-1, -1, 1));
  EXPECT_EQ(map.twist({0, 0, 0, 1}), PlanarVector(1, -1, 1));
}

TEST(LinkMap, PureRotationTurnsAllWheelsTheSameWay) {
  const WheelVector w = LinkMap::with_geometry({}).wheel_velocity({0, 0, 1});
  EXPECT_GT(w[0], 0);
  EXPECT_TRUE((w.array() == w[0]).all()) << w.transpose();
  // A wheel covers the half sum of wheelbase and track per radian: 0.385 m at 0.0475 m radius.
  EXPECT_NEAR(w[0], 0.385 / 0.0475, kRounding * 8);
}

TEST(LinkMap, DrivingForwardTurnsTheLeftWheelsBackwards) {
  const WheelVector w = LinkMap::with_geometry({}).wheel_velocity({1, 0, 0});
  EXPECT_TRUE(w.isApprox(WheelVector(-1, 1, -1, 1) / 0.0475, kRounding)) << w.transpose();
}

TEST(LinkMap, DrivingLeftTurnsFrontAndRearWheelsAgainstEachOther) {
  const WheelVector w = LinkMap::with_geometry({}).wheel_velocity({0, 1, 0});
  EXPECT_TRUE(w.isApprox(WheelVector(1, 1, -1, -1) / 0.0475, kRounding)) << w.transpose();
}

TEST(LinkMap, ReproducesTheOfficialDriversFormulas) {
  Any any;
  for (const BaseGeometry& geometry :
       {BaseGeometry{}, BaseGeometry{0.05, 0.456, 0.316}, BaseGeometry{0.1, 1, 3}}) {
    const LinkMap map = LinkMap::with_geometry(geometry);
    for (int i = 0; i < 50; ++i) {
      const PlanarVector twist = any.planar();
      const WheelVector w = any.wheels();
      EXPECT_TRUE(map.wheel_velocity(twist).isApprox(official_wheel_velocity(twist, geometry), kRounding));
      EXPECT_TRUE(map.twist(w).isApprox(official_twist(w, geometry), kRounding));
    }
  }
}

TEST(LinkMap, DefaultGeometryIsTheOfficialConfiguration) {
  EXPECT_EQ(BaseGeometry{}.wheel_radius_m, 0.0475);
  EXPECT_EQ(BaseGeometry{}.wheelbase_m, 0.47);
  EXPECT_EQ(BaseGeometry{}.track_m, 0.30);
}

TEST(LinkMap, KeepsPowerForEveryMotionAndWrench) {
  Any any;
  for (const WheelSigns signs : {WheelSigns::kCounterClockwise, WheelSigns::kForward})
    for (const LinkMap& map : {LinkMap::with_geometry({}, signs), LinkMap::without_geometry(signs)})
      for (int i = 0; i < 50; ++i) {
        const WheelVector w = any.wheels();
        const PlanarVector wrench = any.planar();
        const double power = wrench.dot(map.twist(w));
        EXPECT_NEAR(map.wheel_torque(wrench).dot(w), power, kRounding * (1 + wrench.norm() * w.norm()));
      }
}

TEST(LinkMap, WheelVelocityAndWrenchAreExactInverses) {
  Any any;
  for (const WheelSigns signs : {WheelSigns::kCounterClockwise, WheelSigns::kForward})
    for (const LinkMap& map : {LinkMap::with_geometry({}, signs), LinkMap::without_geometry(signs)})
      for (int i = 0; i < 50; ++i) {
        const PlanarVector twist = any.planar();
        EXPECT_TRUE(map.twist(map.wheel_velocity(twist)).isApprox(twist, kRounding));
        EXPECT_TRUE(map.wrench(map.wheel_torque(twist)).isApprox(twist, kRounding));
      }
}

TEST(LinkMap, TheCombinationThatOnlyMakesWheelsSlipMovesNothing) {
  // Orthogonal to all rows: wheels 1, 4 against 2, 3.
  const WheelVector fight(1, -1, -1, 1);
  const LinkMap map = LinkMap::with_geometry({});
  EXPECT_NEAR(map.twist(fight).norm(), 0.0, kRounding);
  EXPECT_NEAR(map.wrench(fight).norm(), 0.0, kRounding * 100);  // wrenches are 4/r = 84 times the torque
}

TEST(LinkMap, InTheForwardConventionFourPositiveWheelsDriveForward) {
  const PlanarVector twist = LinkMap::with_geometry({}, WheelSigns::kForward).twist({1, 1, 1, 1});
  EXPECT_TRUE(twist.isApprox(PlanarVector(0.0475, 0, 0), kRounding)) << twist.transpose();
}

TEST(LinkMap, BothConventionsDescribeTheSameBaseOnceWheels1And3AreFlipped) {
  const auto flipped = [](const WheelVector& w) { return WheelVector(-w[0], w[1], -w[2], w[3]); };
  const LinkMap ccw = LinkMap::with_geometry({}, WheelSigns::kCounterClockwise);
  const LinkMap forward = LinkMap::with_geometry({}, WheelSigns::kForward);
  Any any;
  for (int i = 0; i < 50; ++i) {
    const WheelVector w = any.wheels();
    const PlanarVector v = any.planar();
    EXPECT_TRUE(forward.twist(flipped(w)).isApprox(ccw.twist(w), kRounding));
    EXPECT_TRUE(forward.wrench(flipped(w)).isApprox(ccw.wrench(w), kRounding));
    EXPECT_TRUE(flipped(forward.wheel_velocity(v)).isApprox(ccw.wheel_velocity(v), kRounding));
    EXPECT_TRUE(flipped(forward.wheel_torque(v)).isApprox(ccw.wheel_torque(v), kRounding));
  }
}

TEST(LinkMap, AWheelsTorqueBecomesItsForceOnTheFloor) {
  // 4 N forward take 1 N, over the wheel radius, from each wheel; 1 N·m of yaw a quarter of r over the lever.
  const LinkMap map = LinkMap::with_geometry({});
  EXPECT_TRUE(map.wheel_torque({4, 0, 0}).isApprox(0.0475 * WheelVector(-1, 1, -1, 1), kRounding));
  EXPECT_TRUE(map.wheel_torque({0, 0, 1}).isApprox(0.0475 / 4 / 0.385 * WheelVector::Ones(), kRounding));
}

TEST(LinkMap, RefusesGeometryThatIsNotFiniteAndPositive) {
  for (const double bad :
       {0.0, -0.1, std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity()}) {
    EXPECT_THROW(LinkMap::with_geometry({.wheel_radius_m = bad}), std::invalid_argument) << bad;
    EXPECT_THROW(LinkMap::with_geometry({.wheelbase_m = bad}), std::invalid_argument) << bad;
    EXPECT_THROW(LinkMap::with_geometry({.track_m = bad}), std::invalid_argument) << bad;
  }
}

}  // namespace link_map_test
