#include "apps/youbot_bench/arm_space.h"

#include <algorithm>
#include <cmath>
#include <cstddef>

#include "control/arm_protection.h"
#include "control/robot_model.h"

namespace youbot_bench {
namespace {

/// B stands on the floor.
constexpr const char* kBaseLink = "base_footprint";
constexpr const char* kTipLink = "tip";
/// Joints whose places are checked, from 0: elbow, then wrist. Joints 1 and 2 stay where they are.
constexpr std::size_t kElbow = 2;

}  // namespace

ArmSpace::ArmSpace() : arm_(control::read_serial_arm(control::youbot_urdf(), kBaseLink, kTipLink)) {}

bool ArmSpace::is_clear(const Eigen::VectorXd& q_rad) const {
  const control::ArmProtection::Config shapes;
  Eigen::Isometry3d X_BL = Eigen::Isometry3d::Identity();
  for (std::size_t i = 0; i < arm_.links.size(); ++i) {
    const control::ArmLink& link = arm_.links[i];
    X_BL = X_BL * link.X_PL;
    if (i >= kElbow && !is_clear_at(X_BL.translation(), shapes.wrist_radius_m)) return false;
    X_BL.rotate(Eigen::AngleAxisd(q_rad[static_cast<Eigen::Index>(i)], link.axis_L));
  }
  return is_clear_at((X_BL * arm_.X_LT).translation(), shapes.tip_radius_m);
}

bool ArmSpace::is_clear_at(const Eigen::Vector3d& p_B_m, double radius_m) const {
  const control::ArmProtection::Config shapes;
  const double away_m = radius_m + shapes.clearance_m;
  if (p_B_m.z() < away_m) return false;
  const Eigen::Vector3d& half = shapes.body_half_size_m;
  const Eigen::Vector3d beyond(std::abs(p_B_m.x()) - half.x(), std::abs(p_B_m.y()) - half.y(),
                               p_B_m.z() - half.z());
  if (beyond.cwiseMax(0.0).norm() < away_m) return false;
  const double aside_m = std::hypot(p_B_m.x() - control::kJoint1_x_m, p_B_m.y()) - shapes.foot_radius_m;
  return std::hypot(std::max(0.0, aside_m), std::max(0.0, p_B_m.z() - shapes.foot_height_m)) >= away_m;
}

}  // namespace youbot_bench
