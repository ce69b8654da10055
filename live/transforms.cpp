#include "live/transforms.h"

#include <urdf_parser/urdf_parser.h>

#include <stdexcept>

namespace live {
namespace {

Eigen::Vector3d vector(const urdf::Vector3& v) { return {v.x, v.y, v.z}; }

Eigen::Isometry3d isometry(const urdf::Pose& pose) {
  const urdf::Rotation& r = pose.rotation;
  return Eigen::Translation3d(vector(pose.position)) * Eigen::Quaterniond(r.w, r.x, r.y, r.z);
}

}  // namespace

RobotTransforms::RobotTransforms(std::string_view urdf) {
  const urdf::ModelInterfaceSharedPtr model = urdf::parseURDF(std::string(urdf));
  if (!model) throw std::invalid_argument("the robot's description is no URDF");
  for (const auto& [name, joint] : model->joints_) {
    const bool slides = joint->type == urdf::Joint::PRISMATIC;
    const bool turns = joint->type == urdf::Joint::REVOLUTE || joint->type == urdf::Joint::CONTINUOUS;
    joints_.push_back({.name = name,
                       .X_parent_joint = isometry(joint->parent_to_joint_origin_transform),
                       .axis = slides || turns ? vector(joint->axis).normalized() : Eigen::Vector3d::Zero(),
                       .slides = slides});
    transforms_.push_back({joint->parent_link_name, joint->child_link_name});
  }
}

const std::vector<ros::Transform>& RobotTransforms::at(const std::map<std::string, double>& positions) {
  for (std::size_t i = 0; i < joints_.size(); ++i) {
    const Joint& joint = joints_[i];
    const auto found = positions.find(joint.name);
    const double q = found == positions.end() ? 0.0 : found->second;
    Eigen::Isometry3d motion = Eigen::Isometry3d::Identity();
    if (joint.slides)
      motion.translation() = q * joint.axis;
    else if (!joint.axis.isZero())
      motion.linear() = Eigen::AngleAxisd(q, joint.axis).toRotationMatrix();
    transforms_[i].X_parent_child = joint.X_parent_joint * motion;
  }
  return transforms_;
}

}  // namespace live
