/// @file
/// The frames of a robot that a URDF describes.
#pragma once
#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "live/ros_messages.h"

namespace live {

/// Each joint of the URDF as a transform from its parent link to its child link.
class RobotTransforms {
 public:
  /// @throws std::invalid_argument if the description cannot be read. urdfdom prints syntax errors on stderr.
  explicit RobotTransforms(std::string_view urdf);

  /// At these joint positions in rad or m; joints that are missing are at zero.
  const std::vector<ros::Transform>& at(const std::map<std::string, double>& positions);

 private:
  struct Joint {
    std::string name;
    Eigen::Isometry3d X_parent_joint;
    Eigen::Vector3d axis;  // zero: fixed
    bool slides;
  };
  std::vector<Joint> joints_;
  std::vector<ros::Transform> transforms_;  // in the same order
};

}  // namespace live
