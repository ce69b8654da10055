/// @file
/// Pose of the end effector, or its set-point. Frames W and T as in control/robot_model.h.
#pragma once
#include <Eigen/Core>
#include <Eigen/Geometry>

namespace control {

struct TipPose {
  Eigen::Vector3d p_WT_m = Eigen::Vector3d::Zero();
  Eigen::Quaterniond q_WT = Eigen::Quaterniond::Identity();
};

/// With the velocity of the set-point.
struct TipSetpoint : TipPose {
  Eigen::Vector3d v_WT_W_m_per_s = Eigen::Vector3d::Zero();
};

/// Rotation vector from `q_from` to `q_to` on the shorter arc, in their common frame; at half a turn both
/// directions are equally short.
Eigen::Vector3d rotation_between(const Eigen::Quaterniond& q_from, const Eigen::Quaterniond& q_to) noexcept;

}  // namespace control
