// Joint angles for a pose of the end effector, checked by forward kinematics.
#include "control/arm_posture.h"

#include <gtest/gtest.h>

#include <limits>
#include <numbers>
#include <random>

#include "control/planar.h"

namespace arm_posture_test {

using control::arm_posture_for;
using control::ArmVector;
using control::ChainVector;
using control::kArmJoints;
using control::PlanarVector;
using control::RobotModel;
using control::TipPose;
using Eigen::AngleAxisd;
using Eigen::Quaterniond;
using Eigen::Vector3d;

constexpr double kDegree = std::numbers::pi / 180;

ArmVector posture(double joint_1_deg, double joint_2_deg, double joint_3_deg, double joint_4_deg,
                  double joint_5_deg) {
  return kDegree * (ArmVector() << 169 + joint_1_deg, 65 + joint_2_deg, -146 + joint_3_deg,
                    102.5 + joint_4_deg, 167.5 + joint_5_deg)
                       .finished();
}

TipPose tip_at(RobotModel& model, const ArmVector& position_rad) {
  model.update((ChainVector() << PlanarVector::Zero(), position_rad).finished());
  return {model.X_WT().translation(), Quaterniond(model.X_WT().linear())};
}

void expect_reached(RobotModel& model, const TipPose& pose, const ArmVector& seed_rad) {
  const auto found_rad = arm_posture_for(pose, seed_rad, model);
  ASSERT_TRUE(found_rad.has_value()) << pose.p_WT_m.transpose();
  const TipPose reached = tip_at(model, *found_rad);
  EXPECT_LT((reached.p_WT_m - pose.p_WT_m).norm(), 1e-4);
  EXPECT_LT(reached.q_WT.angularDistance(pose.q_WT), 1e-4);
  for (int i = 0; i < kArmJoints; ++i) {
    EXPECT_GE((*found_rad)[i], model.ranges()[static_cast<std::size_t>(i)].lower_rad);
    EXPECT_LE((*found_rad)[i], model.ranges()[static_cast<std::size_t>(i)].upper_rad);
  }
}

TEST(ArmPosture, IsFoundWhereverTheArmCanBeFromNearby) {
  RobotModel model;
  std::mt19937 random(41);
  std::uniform_real_distribution<double> any(-1, 1);
  for (int n = 0; n < 200; ++n) {
    const ArmVector goal_rad = posture(120 * any(random), 20 + 30 * any(random), 60 + 30 * any(random),
                                       40 + 30 * any(random), 120 * any(random));
    const ArmVector seed_rad =
        goal_rad + ArmVector(ArmVector::NullaryExpr([&] { return 0.2 * any(random); }));
    expect_reached(model, tip_at(model, goal_rad), seed_rad);
  }
}

TEST(ArmPosture, TheThesisFirstSetPointIsReachedFromTheUnfoldedArm) {
  RobotModel model;
  const TipPose pose{.p_WT_m = {0.35, 0, 0.35},
                     .q_WT = Quaterniond(AngleAxisd(120 * kDegree, Vector3d::UnitY()))};
  expect_reached(model, pose, posture(0, -23, 46, 46, 0));
}

TEST(ArmPosture, APoseThatIsThereAlreadyIsTheSeedItself) {
  RobotModel model;
  const ArmVector here_rad = posture(10, 20, 60, 40, -30);
  EXPECT_EQ(arm_posture_for(tip_at(model, here_rad), here_rad, model), here_rad);
}

TEST(ArmPosture, WhatIsOutOfReachIsRefused) {
  RobotModel model;
  const ArmVector seed_rad = posture(0, 20, 60, 40, 0);
  const TipPose near = tip_at(model, seed_rad);
  EXPECT_FALSE(arm_posture_for({{1.5, 0, 0.3}, near.q_WT}, seed_rad, model)) << "too far";
  EXPECT_FALSE(arm_posture_for({{0.4, 0, -0.8}, near.q_WT}, seed_rad, model)) << "too low";
  // Joints 2 to 4 move in one upright plane: the hand cannot point out of it.
  const Quaterniond sideways(AngleAxisd(30 * kDegree, Vector3d::UnitZ()) * near.q_WT);
  EXPECT_FALSE(arm_posture_for({near.p_WT_m, sideways}, seed_rad, model));
  // What an arm with an elbow less bound could do.
  TipPose behind_end_stop = tip_at(model, posture(0, 20, 60, 125, 0));
  EXPECT_FALSE(arm_posture_for(behind_end_stop, posture(0, 20, 60, 90, 0), model));
}

TEST(ArmPosture, NumbersThatAreNoneAreRefused) {
  RobotModel model;
  const double nan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_FALSE(arm_posture_for({{nan, 0, 0.3}, Quaterniond::Identity()}, posture(0, 20, 60, 40, 0), model));
}

}  // namespace arm_posture_test
