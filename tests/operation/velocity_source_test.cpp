// Set-points generated from a velocity.
#include "operation/velocity_source.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

namespace velocity_source_test {

using namespace std::chrono_literals;
using control::PlanarPose;
using control::PlanarVector;
using operation::Motion;
using operation::VelocitySource;

struct VelocitySourceTest : testing::Test {
  /// With a base that follows exactly, or stands where `held` says.
  Motion drive(double duration_s, bool held = false) {
    Motion motion;
    for (int i = 0; i < std::lround(1000 * duration_s); ++i) {
      const PlanarVector before = motion_W;
      motion = source.read(now += 1ms, base);
      motion_W = motion.reference.twist_W;
      if (i > 0) largest_step = std::max(largest_step, (motion_W - before).head<2>().norm());
      if (!held) base = motion.reference.X_WB;
    }
    return motion;
  }
  control::BasePath::Limits limits{.speed_m_per_s = 0.5,
                                   .acceleration_m_per_s2 = 0.25,
                                   .turn_speed_rad_per_s = 1.0,
                                   .turn_acceleration_rad_per_s2 = 0.5};
  VelocitySource::Leash leash{.m = 0.07, .rad = 0.15};
  Eigen::AlignedBox2d box = control::Workspace{}.base_W_m;
  VelocitySource::Wheels wheels{.map = control::LinkMap::with_geometry({}), .speed_limit_rad_per_s = 100};
  VelocitySource source{limits, wheels, 1ms, leash, box};
  PlanarPose base;
  PlanarVector motion_W = PlanarVector::Zero();
  double largest_step = 0;
  std::chrono::nanoseconds now{};
};

TEST_F(VelocitySourceTest, RestsUntilCommanded) {
  source.begin(0ns, {});
  const Motion motion = drive(1);
  EXPECT_EQ(motion.reference.twist_W, PlanarVector::Zero());
  EXPECT_EQ(base.x_m, 0);
  EXPECT_FALSE(motion.finished);
  EXPECT_EQ(motion.stamp, now);
}

TEST_F(VelocitySourceTest, SpeedsUpAndBrakesWithinTheAcceleration) {
  source.begin(0ns, {});
  source.tell({0.2, 0, 0});
  drive(2);
  // 0.8 s at 0.25 m/s² to 0.2 m/s, that is 0.08 m, then 1.2 s at that speed.
  EXPECT_NEAR(base.x_m, 0.08 + 0.24, 1e-3);
  source.tell(PlanarVector::Zero());
  drive(2);
  EXPECT_NEAR(base.x_m, 0.08 + 0.24 + 0.08, 1e-3);
  EXPECT_LE(largest_step, 0.25e-3 * (1 + 1e-9));
}

TEST_F(VelocitySourceTest, IsNoFasterThanItsLimitsWhateverTheCommand) {
  source.begin(0ns, {});
  source.tell({30, 40, -9});
  const Motion motion = drive(4);
  EXPECT_NEAR(motion.reference.twist_W.head<2>().norm(), 0.5, 1e-9) << "shortened along its direction";
  EXPECT_NEAR(motion.reference.twist_W[2], -1.0, 1e-9);
}

TEST_F(VelocitySourceTest, SlowsDownAWholeTwistThatWouldTurnAWheelTooFastAndKeepsItsDirection) {
  // Radius 0.0475 m, half of wheelbase and track 0.385 m: 0.3 m/s each way and 0.5 rad/s turn one wheel at
  // (0.3 + 0.3 + 0.385 * 0.5) / 0.0475 = 16.7 rad/s.
  wheels.speed_limit_rad_per_s = 10;
  VelocitySource slowed(limits, wheels, 1ms, leash, box);
  slowed.begin(0ns, {});
  slowed.tell({0.3, 0.3, 0.5});
  PlanarVector twist_B;
  for (int i = 0; i < 6000; ++i) {
    // From straight ahead to a turn on the spot; in between both add up.
    if (i == 3000) slowed.tell({0, 0, -1});
    const Motion motion = slowed.read(now += 1ms, base);
    base = motion.reference.X_WB;
    twist_B = control::rotated(motion.reference.twist_W, -base.yaw_rad);
    const double fastest_m_per_s = std::abs(twist_B[0]) + std::abs(twist_B[1]) + 0.385 * std::abs(twist_B[2]);
    ASSERT_LE(fastest_m_per_s / 0.0475, 10 * (1 + 1e-9)) << i;
    if (i == 2999) {
      EXPECT_NEAR(twist_B[0], 0.3 * 10 / 16.684, 1e-3);
      EXPECT_NEAR(twist_B[1], 0.3 * 10 / 16.684, 1e-3);
      EXPECT_NEAR(twist_B[2], 0.5 * 10 / 16.684, 1e-3);
    }
  }
  EXPECT_NEAR(twist_B[2], -1.0, 1e-9) << "0.385 / 0.0475 = 8.1 rad/s";
}

TEST_F(VelocitySourceTest, AheadIsWhereTheBaseLooks) {
  source.begin(0ns, {});
  source.tell({0, 0, 0.8});
  drive(3);
  source.tell(PlanarVector::Zero());
  drive(3);
  const PlanarPose turned = base;
  EXPECT_GT(turned.yaw_rad, 1.0);
  source.tell({0.2, 0, 0});
  drive(2);
  EXPECT_NEAR(std::atan2(base.y_m - turned.y_m, base.x_m - turned.x_m), turned.yaw_rad, 1e-6);
  EXPECT_NEAR(base.yaw_rad, turned.yaw_rad, 1e-9);
}

TEST_F(VelocitySourceTest, GoesOnOverAPauseAsTheBaseDoes) {
  source.begin(0ns, {});
  source.tell({0.3, 0, 0});
  drive(3);
  const double before_m = base.x_m;
  base.x_m += 0.3 * 0.081;  // of which nothing was read
  now += 80ms;
  const Motion motion = drive(0.001);
  EXPECT_NEAR(motion.reference.X_WB.x_m - before_m, 0.3 * 0.081, 1e-9);
  EXPECT_NEAR(motion.reference.twist_W.x(), 0.3, 1e-9);
}

TEST_F(VelocitySourceTest, ABaseThatIsHeldBackIsNotLeftBehind) {
  source.begin(0ns, {});
  source.tell({0.5, 0, 0.8});
  const Motion motion = drive(30, /*held=*/true);
  EXPECT_NEAR(std::hypot(motion.reference.X_WB.x_m, motion.reference.X_WB.y_m), leash.m, 1e-9);
  EXPECT_NEAR(motion.reference.X_WB.yaw_rad, leash.rad, 1e-9);
}

TEST_F(VelocitySourceTest, BrakesBeforeAWallWithinTheAccelerationAndGlidesAlongIt) {
  box = {Eigen::Vector2d(-1, -1), Eigen::Vector2d(1, 1)};
  VelocitySource walled(limits, wheels, 1ms, leash, box);
  walled.begin(0ns, {});
  walled.tell({0.4, 0.1, 0});
  PlanarVector last = PlanarVector::Zero();
  Motion motion;
  for (int i = 0; i < 8000; ++i) {
    motion = walled.read(now += 1ms, base);
    // Of the square root's last step a period is too long.
    EXPECT_LE((motion.reference.twist_W - last).head<2>().norm(), 2 * 0.25e-3) << i;
    last = motion.reference.twist_W;
    base = motion.reference.X_WB;
    ASSERT_LE(base.x_m, 1.0);
  }
  EXPECT_NEAR(base.x_m, 1.0, 1e-3);
  // Minus the distance lost while accelerating: 0.412 m/s at 0.25 m/s².
  EXPECT_NEAR(base.y_m, 0.1 * (8 - 0.412 / 0.25 / 2), 0.01) << "along the wall it goes on";
  EXPECT_TRUE(motion.at_wall);
  walled.tell({-0.4, 0, 0});
  for (int i = 0; i < 2000; ++i) base = (motion = walled.read(now += 1ms, base)).reference.X_WB;
  EXPECT_LT(base.x_m, 0.8) << "away from it at once";
  EXPECT_FALSE(motion.at_wall);
}

}  // namespace velocity_source_test
