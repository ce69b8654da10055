/// @file
/// Keeps the arm away from its end stops, singular poses and the robot's own body by pushing it back softly.
#pragma once
#include <Eigen/Core>
#include <array>

#include "control/robot_model.h"

namespace control {

/// Each limit has a spring that starts a margin before it, with a damper against further approach.
/// - Joints: away from their end stops; no other torque may drive a joint towards its stop.
/// - Elbow: joint 3 away from the stretched arm, on the side that bends the end effector forward. When the
///   arm is stretched, elbow torque cannot move the end effector in or out.
/// - Shoulder: the end effector away from the axis of joint 1, where that joint no longer moves it.
/// - Body: end effector and wrist out of the base and the arm's foot, and off the floor.
/// The forces act between the robot's own parts: on the arm's joints, and on the base only as any arm torque
/// does. One thread. Cycle: all but construction.
class ArmProtection {
 public:
  struct Config {
    double joint_margin_rad = 0.15;
    /// Torque at the limit.
    std::array<double, kArmJoints> joint_torque_Nm{6.0, 8.0, 5.0, 2.0, 1.0};
    double joint_damping_ratio = 1.0;
    double straight_joint3_rad = -2.5482;  ///< -146 degrees
    double elbow_bend_rad = 0.15;          ///< minimum bend from there
    double elbow_torque_Nm = 1.5;          ///< when stretched
    double shoulder_radius_m = 0.08;
    double clearance_m = 0.03;  ///< a push begins at this distance
    double push_N = 30.0;       ///< at the surface; increases further inside
    double push_damping_N_s_per_m = 60.0;
    /// Body: a box around the centre of the base up to this height, and a column around the axis of joint 1.
    Eigen::Vector3d body_half_size_m{0.29, 0.19, 0.14};  ///< half length, half width, whole height
    double foot_radius_m = 0.09;
    double foot_height_m = 0.24;
    double tip_radius_m = 0.03;
    double wrist_radius_m = 0.06;
  };
  struct Output {
    ArmVector torque_Nm = ArmVector::Zero();
    /// Share of another torque that is passed on if it drives a joint towards its lower or upper stop: 1 in
    /// free space, 0 at the stop.
    ArmVector share_downwards = ArmVector::Ones();
    ArmVector share_upwards = ArmVector::Ones();
    bool active = false;
  };

  /// @throws std::invalid_argument naming the value out of range.
  ArmProtection(const Config& config, const std::array<JointRange, kArmJoints>& ranges);

  /// `model` must be updated to the joint positions.
  Output torque(const RobotModel& model, const ArmVector& position_rad,
                const ArmVector& velocity_rad_per_s) const noexcept;

 private:
  /// A spring towards `direction` that reaches `torque_Nm` where `depth_rad` equals `margin_rad`.
  void guard_joint(int joint, double depth_rad, double margin_rad, double torque_Nm, double direction,
                   double velocity_rad_per_s, Output& output) const noexcept;
  void guard_point(const RobotModel& model, Link link, const Eigen::Vector3d& p_W_m, double radius_m,
                   const ArmVector& velocity_rad_per_s, Output& output) const noexcept;
  void push(const PointJacobian& jacobian, const Eigen::Vector3d& outwards_W, double distance_m,
            const ArmVector& velocity_rad_per_s, Output& output) const noexcept;

  Config config_;
  std::array<JointRange, kArmJoints> ranges_;
};

}  // namespace control
