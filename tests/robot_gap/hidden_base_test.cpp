// The hidden bases move as their geometry says: the judge must be right before it judges.
#include "tests/robot_gap/hidden_base.h"

#include <gtest/gtest.h>

#include <cmath>
#include <utility>
#include <vector>

#include "tests/robot_gap/base_cases.h"

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

// Steady wheels need their friction alone; the slope takes its share of the weight by the radius.
TEST(HiddenBase, TorquesCarryFrictionAndTheSlope) {
  const HiddenBase level(weighed(two_wheeler()), {});
  const HiddenBase sloped(weighed(two_wheeler()), {{"floor_slope", "floor", 0.01, 0.02}});
  const BasePlan line{.motion = BaseMotion::kLines, .seconds = 8, .lag_s = 0};
  const BaseRecording seen = level.record(line, "line");
  const BaseRecording on_slope = sloped.record(line, "line");
  const double rate = 0.25 / 0.042;
  const double heading = seen.heading_rad[200];
  const double uphill_N = 5 * 9.81 * (0.01 * std::cos(heading) + 0.02 * std::sin(heading));
  const auto mean_Nm = [](const BaseRecording& one) { return one.torque_Nm.middleCols(200, 100).mean(); };
  EXPECT_NEAR(mean_Nm(seen), 0.02 + 0.003 * rate, 0.002);
  EXPECT_NEAR(mean_Nm(on_slope) - mean_Nm(seen), uphill_N * 0.042 / 2, 0.001);
}

Judged judged(BaseCase::Group group, std::vector<BaseEffect> hidden) {
  return judge_base({group, weighed(two_wheeler()), std::move(hidden), 1});
}

TEST(HiddenBase, AHeavierBaseWithAStiffWheelIsNamedFromItsTorques) {
  const Judged answer =
      judged(BaseCase::Group::kForcesPairs, {{"mass", "base", 0.2}, {"coulomb", "right", 0.012}});
  EXPECT_TRUE(answer.right) << answer.result.reason;
}

TEST(HiddenBase, ALoadThatIsPutOnHalfWayHasNoName) {
  const Judged answer = judged(BaseCase::Group::kForcesOutside, {{"payload_put_on", "base", 0.3}});
  EXPECT_TRUE(answer.result.effects.empty());
  EXPECT_EQ(answer.result.verdict, identification::robot_gap::Verdict::kUnexplained);
}

}  // namespace
}  // namespace robot_gap_test
