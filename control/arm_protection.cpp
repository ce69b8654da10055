#include "control/arm_protection.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>

#include "control/positive.h"

namespace control {
namespace {

/// Reflected rotor and links, approximate: for the damping ratio.
constexpr std::array<double, kArmJoints> kJointInertia_kg_m2{0.5, 0.5, 0.2, 0.1, 0.07};

}  // namespace

ArmProtection::ArmProtection(const Config& config, const std::array<JointRange, kArmJoints>& ranges)
    : config_(config), ranges_(ranges) {
  const RequirePositive require_positive{"arm protection"};
  require_positive(config.joint_margin_rad, "joint_margin_rad");
  for (const double torque_Nm : config.joint_torque_Nm) require_positive(torque_Nm, "joint_torque_Nm");
  require_positive(config.joint_damping_ratio, "joint_damping_ratio");
  require_positive(config.elbow_bend_rad, "elbow_bend_rad");
  require_positive(config.elbow_torque_Nm, "elbow_torque_Nm");
  require_positive(config.shoulder_radius_m, "shoulder_radius_m");
  require_positive(config.clearance_m, "clearance_m");
  require_positive(config.push_N, "push_N");
  require_positive(config.push_damping_N_s_per_m, "push_damping_N_s_per_m");
  for (const double half_m : config.body_half_size_m) require_positive(half_m, "body_half_size_m");
  require_positive(config.foot_radius_m, "foot_radius_m");
  require_positive(config.foot_height_m, "foot_height_m");
  require_positive(config.tip_radius_m, "tip_radius_m");
  require_positive(config.wrist_radius_m, "wrist_radius_m");
  for (const JointRange& range : ranges)
    if (!(range.upper_rad - range.lower_rad > 2 * config.joint_margin_rad))
      throw std::invalid_argument("arm protection: joint_margin_rad = " +
                                  std::to_string(config.joint_margin_rad) + " leaves a joint nowhere to be");
}

ArmProtection::Output ArmProtection::torque(const RobotModel& model, const ArmVector& position_rad,
                                            const ArmVector& velocity_rad_per_s) const noexcept {
  Output output;
  for (int i = 0; i < kArmJoints; ++i) {
    const JointRange& range = ranges_[static_cast<std::size_t>(i)];
    const double margin = config_.joint_margin_rad;
    const double torque_Nm = config_.joint_torque_Nm[static_cast<std::size_t>(i)];
    const double low_rad = range.lower_rad + margin - position_rad[i];
    const double high_rad = position_rad[i] - (range.upper_rad - margin);
    guard_joint(i, low_rad, margin, torque_Nm, 1, velocity_rad_per_s[i], output);
    guard_joint(i, high_rad, margin, torque_Nm, -1, velocity_rad_per_s[i], output);
    output.share_downwards[i] = std::clamp(1 - low_rad / margin, 0.0, 1.0);
    output.share_upwards[i] = std::clamp(1 - high_rad / margin, 0.0, 1.0);
  }
  constexpr int kElbow = 2;
  const double bend_rad = position_rad[kElbow] - config_.straight_joint3_rad;
  guard_joint(kElbow, config_.elbow_bend_rad - bend_rad, config_.elbow_bend_rad, config_.elbow_torque_Nm, 1,
              velocity_rad_per_s[kElbow], output);

  guard_point(model, Link::kArm5, model.X_WT().translation(), config_.tip_radius_m, velocity_rad_per_s,
              output);
  guard_point(model, Link::kArm5, model.X_WL(Link::kArm5).translation(), config_.wrist_radius_m,
              velocity_rad_per_s, output);

  const Eigen::Vector3d from_axis_m = model.X_WT().translation() - model.X_WL(Link::kArm1).translation();
  const Eigen::Vector3d radius_m(from_axis_m.x(), from_axis_m.y(), 0);
  const double distance_m = radius_m.norm();
  if (distance_m > 1e-6)
    push(model.point_jacobian(Link::kArm5, model.X_WT().translation()), radius_m / distance_m,
         distance_m - config_.shoulder_radius_m, velocity_rad_per_s, output);
  return output;
}

void ArmProtection::guard_joint(int joint, double depth_rad, double margin_rad, double torque_Nm,
                                double direction, double velocity_rad_per_s, Output& output) const noexcept {
  if (!(depth_rad > 0)) return;
  const double stiffness = torque_Nm / margin_rad;
  const double damping = 2 * config_.joint_damping_ratio *
                         std::sqrt(stiffness * kJointInertia_kg_m2[static_cast<std::size_t>(joint)]);
  // The damper fades in, because it would otherwise start with a shock; it does not resist motion away from
  // the limit.
  const double share = std::min(1.0, depth_rad / margin_rad);
  const double inwards = std::max(0.0, -direction * velocity_rad_per_s);
  output.torque_Nm[joint] += direction * (stiffness * depth_rad + share * damping * inwards);
  output.active = true;
}

void ArmProtection::guard_point(const RobotModel& model, Link link, const Eigen::Vector3d& p_W_m,
                                double radius_m, const ArmVector& velocity_rad_per_s,
                                Output& output) const noexcept {
  const PointJacobian jacobian = model.point_jacobian(link, p_W_m);
  push(jacobian, Eigen::Vector3d::UnitZ(), p_W_m.z() - radius_m, velocity_rad_per_s, output);

  const Eigen::Isometry3d& X_WB = model.X_WL(Link::kBase);
  const Eigen::Vector3d p_B_m = X_WB.inverse() * p_W_m;
  // Distance to a box that stands on the floor: outside by the nearest point, inside by the nearest face.
  const Eigen::Vector3d& half = config_.body_half_size_m;
  const Eigen::Vector3d beyond(std::abs(p_B_m.x()) - half.x(), std::abs(p_B_m.y()) - half.y(),
                               p_B_m.z() - half.z());
  Eigen::Vector3d outwards_B = beyond.cwiseMax(0.0);
  double distance_m = outwards_B.norm();
  if (distance_m < 1e-9) {
    Eigen::Index face = 0;
    distance_m = beyond.maxCoeff(&face);
    outwards_B = Eigen::Vector3d::Unit(face);
  }
  outwards_B.x() = std::copysign(outwards_B.x(), p_B_m.x());
  outwards_B.y() = std::copysign(outwards_B.y(), p_B_m.y());
  push(jacobian, X_WB.linear() * outwards_B.normalized(), distance_m - radius_m, velocity_rad_per_s, output);

  // The foot, likewise: a vertical column on the floor.
  Eigen::Vector3d from_axis_m = p_W_m - model.X_WL(Link::kArm1).translation();
  from_axis_m.z() = 0;
  const double radius_from_axis_m = from_axis_m.norm();
  if (radius_from_axis_m < 1e-6) return;
  const Eigen::Vector3d sideways_W = from_axis_m / radius_from_axis_m;
  const double aside_m = radius_from_axis_m - config_.foot_radius_m;
  const double above_m = p_B_m.z() - config_.foot_height_m;
  if (aside_m > 0 && above_m > 0) {
    const double away_m = std::hypot(aside_m, above_m);
    push(jacobian, (aside_m * sideways_W + above_m * Eigen::Vector3d::UnitZ()) / away_m, away_m - radius_m,
         velocity_rad_per_s, output);
  } else if (aside_m > above_m) {
    push(jacobian, sideways_W, aside_m - radius_m, velocity_rad_per_s, output);
  } else {
    push(jacobian, Eigen::Vector3d::UnitZ(), above_m - radius_m, velocity_rad_per_s, output);
  }
}

void ArmProtection::push(const PointJacobian& jacobian, const Eigen::Vector3d& outwards_W, double distance_m,
                         const ArmVector& velocity_rad_per_s, Output& output) const noexcept {
  const double depth_m = config_.clearance_m - distance_m;
  if (!(depth_m > 0)) return;
  const ArmVector lever = jacobian.rightCols<kArmJoints>().transpose() * outwards_W;
  const double share = std::min(1.0, depth_m / config_.clearance_m);
  const double inwards_m_per_s = std::max(0.0, -lever.dot(velocity_rad_per_s));
  output.torque_Nm += (config_.push_N * depth_m / config_.clearance_m +
                       share * config_.push_damping_N_s_per_m * inwards_m_per_s) *
                      lever;
  output.active = true;
}

}  // namespace control
