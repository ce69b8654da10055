// Workspace limits of base and end effector.
#include "control/workspace.h"

#include <gtest/gtest.h>

namespace control {
namespace {

TEST(Workspace, WithoutWallsEverythingIsInside) {
  const Workspace free;
  const Eigen::Vector3d far_m(1e6, -1e6, 3);
  EXPECT_EQ(held_in(free.tip_W_m, far_m), far_m);
  EXPECT_EQ(outside_m(free.tip_W_m, far_m), 0.0);
  EXPECT_EQ(outside_m(free.base_W_m, Eigen::Vector2d(-1e6, 1e6)), 0.0);
}

TEST(Workspace, HoldsAtTheNearestWallAndMeasuresHowFarOutside) {
  const Eigen::AlignedBox2d box_m(Eigen::Vector2d(-1, -2), Eigen::Vector2d(3, 2));
  EXPECT_EQ(held_in(box_m, Eigen::Vector2d(3.3, 1)), Eigen::Vector2d(3, 1));
  EXPECT_NEAR(outside_m(box_m, Eigen::Vector2d(3.3, 2.4)), 0.5, 1e-12);  // 3-4-5
  EXPECT_EQ(outside_m(box_m, Eigen::Vector2d(3, -2)), 0.0) << "a wall is inside";
}

TEST(Workspace, AWallOnOneSideLeavesTheOthersOpen) {
  Workspace workspace;
  workspace.tip_W_m.min().z() = 0.05;
  EXPECT_EQ(held_in(workspace.tip_W_m, Eigen::Vector3d(9, 9, -1)), Eigen::Vector3d(9, 9, 0.05));
}

}  // namespace
}  // namespace control
