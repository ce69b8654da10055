/// @file
/// Base and arm as one chain of eight axes: kinematics and dynamics by Orocos KDL.
///
/// Frames: W and B as in control/planar.h, on the floor. T is the end effector: midway between the finger
/// tips, z out of the gripper, y along joints 2 to 4 when joint 5 is in the middle of its range. Axes of the
/// chain: base x, y [m] and yaw [rad] in W, then arm joints 1 to 5 [rad] in the official driver's angles: 0
/// at the stop that homing finds.
#pragma once
#include <Eigen/Core>
#include <Eigen/Geometry>
#include <array>
#include <memory>
#include <string_view>

namespace control {

inline constexpr int kBaseAxes = 3;
inline constexpr int kArmJoints = 5;
inline constexpr int kChainAxes = kBaseAxes + kArmJoints;

/// Forces of the chain are N for base x and y, N·m for the others.
using ChainVector = Eigen::Matrix<double, kChainAxes, 1>;
using ChainMatrix = Eigen::Matrix<double, kChainAxes, kChainAxes>;
using ArmVector = Eigen::Matrix<double, kArmJoints, 1>;
/// For a point P fixed to a link: [v_WP_W; w_WP_W] = J·q̇, linear rows first.
using Jacobian = Eigen::Matrix<double, 6, kChainAxes>;
using PointJacobian = Eigen::Matrix<double, 3, kChainAxes>;
/// [force; moment], in W.
using Wrench = Eigen::Matrix<double, 6, 1>;

/// Bodies that move relative to each other; the frame of an arm link is that of the joint that moves it. The
/// arm's foot belongs to the base, the gripper to the last link.
enum class Link { kBase, kArm1, kArm2, kArm3, kArm4, kArm5 };
inline constexpr int kLinks = 6;

/// Axis of joint 1 in B: the arm's foot is at 0.143 m, joint 1 is 0.024 m in front of it.
inline constexpr double kJoint1_x_m = 0.167;

struct JointRange {
  double lower_rad = 0.0;
  double upper_rad = 0.0;
};

/// Differences between a robot and the description: for better known robots, and for simulated ones whose
/// parameters are unknown to control.
struct ModelChanges {
  struct LinkChange {
    double mass_factor = 1.0;                               ///< on mass and rotational inertia
    Eigen::Vector3d com_shift_m = Eigen::Vector3d::Zero();  ///< in the link's frame
    /// Added to the rotational inertia about the centre of mass, in the link's axes, after the factor.
    Eigen::Matrix3d inertia_change_kg_m2 = Eigen::Matrix3d::Zero();
  };
  std::array<LinkChange, kLinks> links{};
  double payload_kg = 0.0;                                  ///< a point mass, not negative
  Eigen::Vector3d payload_p_T_m = Eigen::Vector3d::Zero();  ///< its place in T
};

/// The description: youbot.urdf in this folder, with the source of every number.
std::string_view youbot_urdf() noexcept;

/// One thread. Cycle: update() and the functions after it; nothing allocates after construction.
class RobotModel {
 public:
  /// @throws std::invalid_argument if the description cannot be read or is not such a chain, or if a change
  /// is not finite, makes a mass non-positive or a moment of inertia negative. urdfdom prints syntax errors
  /// of the URDF on stderr.
  explicit RobotModel(const ModelChanges& changes = {}, std::string_view urdf = youbot_urdf());
  RobotModel(RobotModel&&) noexcept;
  RobotModel& operator=(RobotModel&&) noexcept;
  ~RobotModel();

  /// From the description: range between the end stops.
  const std::array<JointRange, kArmJoints>& ranges() const noexcept;
  double total_mass_kg() const noexcept;

  /// Kinematics at `q`, for the next four functions. Finite arguments.
  void update(const ChainVector& q) noexcept;
  const Eigen::Isometry3d& X_WT() const noexcept;
  const Jacobian& J_WT() const noexcept;
  /// Frame of a link.
  const Eigen::Isometry3d& X_WL(Link link) const noexcept;
  /// Jacobian of a point at `p_W`, fixed to a link.
  PointJacobian point_jacobian(Link link, const Eigen::Vector3d& p_W) const noexcept;

  /// Dynamics at the `q` of update(): M·q̈ + c(q, q̇) + g = τ + Jᵀ·F. Rigid links only, without rotors and
  /// wheels. Each call recomputes.
  ChainMatrix mass() noexcept;
  /// g: torques that hold the links against gravity.
  ChainVector gravity_Nm() noexcept;
  /// c: centrifugal and Coriolis forces.
  ChainVector coriolis_Nm(const ChainVector& velocity) noexcept;

 private:
  struct Chain;
  std::unique_ptr<Chain> chain_;
};

}  // namespace control
