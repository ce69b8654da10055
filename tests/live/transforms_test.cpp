// The frames of the stream, against the model that controls the robot.
#include "live/transforms.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <random>
#include <stdexcept>
#include <string>

#include "control/robot_model.h"

namespace transforms_test {

/// The pose of a link in the world: the chain of the transforms above it.
Eigen::Isometry3d in_world(const std::vector<live::ros::Transform>& transforms, std::string link) {
  Eigen::Isometry3d X_WL = Eigen::Isometry3d::Identity();
  while (link != "world") {
    const auto joint =
        std::ranges::find_if(transforms, [&](const auto& transform) { return transform.child == link; });
    if (joint == transforms.end()) throw std::runtime_error(link + " has no parent");
    X_WL = joint->X_parent_child * X_WL;
    link = joint->parent;
  }
  return X_WL;
}

TEST(RobotTransforms, AreThoseOfTheModelAtAnyPose) {
  control::RobotModel model;
  live::RobotTransforms transforms(control::youbot_urdf());
  std::mt19937 random(21);
  std::uniform_real_distribution<double> number(-3, 3);
  for (int pose = 0; pose < 100; ++pose) {
    control::ChainVector q;
    for (double& coordinate : q) coordinate = number(random);
    std::map<std::string, double> positions{{"base_x", q[0]}, {"base_y", q[1]}, {"base_yaw", q[2]}};
    for (int i = 0; i < control::kArmJoints; ++i) positions["arm_joint_" + std::to_string(i + 1)] = q[3 + i];
    model.update(q);
    const auto& all = transforms.at(positions);
    EXPECT_TRUE(in_world(all, "tip").isApprox(model.X_WT(), 1e-9)) << "pose " << pose;
    EXPECT_TRUE(in_world(all, "arm_link_3").isApprox(model.X_WL(control::Link::kArm3), 1e-9))
        << "pose " << pose;
    EXPECT_TRUE(in_world(all, "base_footprint").isApprox(model.X_WL(control::Link::kBase), 1e-9))
        << "pose " << pose;
  }
}

TEST(RobotTransforms, AJointWithoutAPositionIsAtZero) {
  live::RobotTransforms one(control::youbot_urdf());
  live::RobotTransforms other(control::youbot_urdf());
  const Eigen::Isometry3d at_zero = in_world(one.at({{"arm_joint_1", 0.0}, {"base_x", 0.0}}), "tip");
  EXPECT_TRUE(in_world(other.at({{"no_such_joint", 1.0}}), "tip").isApprox(at_zero));
}

TEST(RobotTransforms, ATextThatIsNoDescriptionIsAnError) {
  EXPECT_THROW(live::RobotTransforms(""), std::invalid_argument);
  EXPECT_THROW(live::RobotTransforms("<robot"), std::invalid_argument);
}

}  // namespace transforms_test
