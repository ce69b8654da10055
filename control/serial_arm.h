/// @file
/// A serial arm as its URDF describes it: any number of joints between a base link and a tip link.
///
/// Frames: B is the base link's, L a link's, which is that of the joint that moves it (URDF), T the tip
/// link's.
#pragma once
#include <Eigen/Core>
#include <Eigen/Geometry>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace control {

/// Mass, centre and rotational inertia of a rigid body, in the frame L of its link.
struct LinkInertia {
  double mass_kg = 0;
  Eigen::Vector3d p_LC_m = Eigen::Vector3d::Zero();  ///< centre of mass C
  Eigen::Matrix3d about_C_kg_m2 = Eigen::Matrix3d::Zero();
};

/// Of a joint [rad, N·m, rad/s; of one that slides m, N, m/s].
struct JointLimits {
  double lower = 0;
  double upper = 0;
  double effort = 0;
  double speed = 0;
};

/// A joint and the link that it moves, with everything fixed to that link.
struct ArmLink {
  std::string joint;
  std::string link;
  bool slides = false;                                     ///< prismatic; otherwise it turns
  Eigen::Isometry3d X_PL = Eigen::Isometry3d::Identity();  ///< in the frame P of the link before, at zero
  Eigen::Vector3d axis_L = Eigen::Vector3d::UnitZ();       ///< of unit length
  LinkInertia inertia;
  std::optional<JointLimits> limits{};  ///< none: continuous, or without a range
};

struct SerialArm {
  std::vector<ArmLink> links;                              ///< from base to tip, at least one
  Eigen::Isometry3d X_LT = Eigen::Isometry3d::Identity();  ///< tip in the frame of the last link
};

/// The chain from `base` to `tip`. Bodies off the chain count as fixed to it, in the zero position of their
/// joints. Links without inertia have none.
/// @throws std::invalid_argument naming link or joint if the text cannot be read, a link does not exist, no
/// joint moves between them, a joint is neither revolute, continuous nor prismatic, or a value is not finite.
SerialArm read_serial_arm(std::string_view urdf, const std::string& base, const std::string& tip);

/// The least moment of inertia about any axis if it is negative by more than rounding, which no body has;
/// otherwise empty. `scale_kg_m2`: norm of the largest tensor that this one was computed from, because a
/// difference has the rounding of its operands. NaN is negative.
std::optional<double> negative_moment_kg_m2(const Eigen::Matrix3d& tensor_kg_m2, double scale_kg_m2);

}  // namespace control
