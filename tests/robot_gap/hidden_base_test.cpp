// The hidden bases move as their geometry says: the judge must be right before it judges.
#include "tests/robot_gap/hidden_base.h"

#include <gtest/gtest.h>

#include <cmath>

namespace robot_gap_test {
namespace {

Eigen::Vector3d twist_of(const HiddenBase& base, const Eigen::VectorXd& speed, double steering = 0) {
  return base.rolling_twist(speed, steering);
}

TEST(HiddenBase, TwoWheelsTurnByTheirDifferenceOverTheTrack) {
  const HiddenBase base(two_wheeler(), {});
  EXPECT_TRUE(twist_of(base, Eigen::Vector2d(0.1, 0.3)).isApprox(Eigen::Vector3d(0.2, 0, 1), 1e-12));
}

TEST(HiddenBase, ATricycleTurnsAboutAPointOnItsRearAxle) {
  const HiddenBase base(tricycle(), {});
  const double steering = 0.4;
  const Eigen::Vector3d twist = twist_of(base, Eigen::VectorXd::Constant(1, 0.2), steering);
  EXPECT_NEAR(twist[0], 0.2 * std::cos(steering), 1e-12);
  EXPECT_NEAR(twist[1], 0, 1e-12);
  EXPECT_NEAR(twist[0] / twist[2], 0.15 / std::tan(steering), 1e-12);
}

TEST(HiddenBase, OmniWheelsAlikeTurnTheBaseOnTheSpot) {
  const HiddenBase base(omni_base(), {});
  EXPECT_TRUE(twist_of(base, Eigen::Vector3d::Constant(0.19)).isApprox(Eigen::Vector3d(0, 0, 1), 1e-12));
  // Wheel 2, behind, drives to the right: the other two to the left by half as much.
  EXPECT_TRUE(twist_of(base, Eigen::Vector3d(0.05, -0.1, 0.05)).isApprox(Eigen::Vector3d(0, 0.1, 0), 1e-12));
}

TEST(HiddenBase, MecanumWheelsMoveTheBaseAsTheFramesDocumentSays) {
  const HiddenBase base(mecanum_base(), {});
  const double lever_m = (0.47 + 0.30) / 2;
  EXPECT_TRUE(
      twist_of(base, Eigen::Vector4d(-0.2, 0.2, -0.2, 0.2)).isApprox(Eigen::Vector3d(0.2, 0, 0), 1e-12));
  EXPECT_TRUE(
      twist_of(base, Eigen::Vector4d(0.2, 0.2, -0.2, -0.2)).isApprox(Eigen::Vector3d(0, 0.2, 0), 1e-12));
  EXPECT_TRUE(twist_of(base, Eigen::Vector4d::Constant(lever_m)).isApprox(Eigen::Vector3d(0, 0, 1), 1e-12));
}

TEST(HiddenBase, ASmallerWheelMovesTheBaseLessThanItsCounts) {
  const HiddenBase base(two_wheeler(), {{"wheel_radius", "base", -0.1}});
  const BaseRecording seen = base.record({.motion = BaseMotion::kLines, .seconds = 8, .lag_s = 0}, "line");
  // Forward, for 6 s after 1 s.
  const Eigen::Index at = 8 * 50;
  const double rolled_m = 0.042 * (seen.wheel_rad(0, at) + seen.wheel_rad(1, at)) / 2;
  const double moved_m = std::hypot(seen.x_m[at] - seen.x_m[0], seen.y_m[at] - seen.y_m[0]);
  EXPECT_NEAR(rolled_m, 1.5, 0.05);
  EXPECT_NEAR(moved_m / rolled_m, 0.9, 0.002);
}

TEST(HiddenBase, TheTrackerIsLate) {
  const HiddenBase base(mecanum_base(), {});
  const BaseRecording now = base.record({.seconds = 20, .seed = 3, .lag_s = 0}, "now");
  const BaseRecording late = base.record({.seconds = 20, .seed = 3, .lag_s = 0.04}, "late");
  for (std::size_t i = 2; i < now.time_s.size(); i += 50) EXPECT_NEAR(late.x_m[i], now.x_m[i - 2], 0.003);
}

}  // namespace
}  // namespace robot_gap_test
