/// @file
/// Inverse dynamics of a serial arm, linear in the inertial parameters of its links.
#pragma once
#include <Eigen/Core>
#include <vector>

#include "control/serial_arm.h"

namespace identification::robot_gap {

/// Of a link, about the origin of its frame L and in its axes: mass [kg], first moments [kg·m], then the
/// rotational inertia xx, xy, xz, yy, yz, zz [kg·m²].
using InertialVector = Eigen::Matrix<double, 10, 1>;
/// Columns: changes of a link's inertial parameters.
using InertialChanges = Eigen::Matrix<double, 10, Eigen::Dynamic>;

InertialVector inertial_vector(const control::LinkInertia& body);
/// Of a point mass of 1 kg at `p_L_m`.
InertialVector unit_mass_at(const Eigen::Vector3d& p_L_m);
/// Derivative of inertial_vector() with the centre of mass, by x, y and z [kg·m and kg·m² per m].
InertialChanges by_centre(const control::LinkInertia& body);
/// Derivative with the rotational inertia about the centre, in the order of InertialVector.
InertialChanges by_inertia();

/// Recursive Newton-Euler method. [J. Luh, M. Walker, R. Paul, ASME J. Dyn. Syst. 102, 1980; linear in the
/// parameters: C. Atkeson, C. An, J. Hollerbach, Int. J. Robotics Research 5(3), 1986]
///
///     arm.move(q, v, a, gravity_B);
///     arm.add_torques(2, changes, 1.0, torques_Nm);
class RigidArm {
 public:
  explicit RigidArm(const control::SerialArm& arm);

  Eigen::Index joints() const noexcept { return static_cast<Eigen::Index>(links_.size()); }
  /// Angles, velocities and accelerations of the joints [rad, rad/s, rad/s²; of those that slide m, m/s,
  /// m/s²]; `gravity_B_m_per_s2` in the base frame.
  void move(const Eigen::VectorXd& q, const Eigen::VectorXd& v, const Eigen::VectorXd& a,
            const Eigen::Vector3d& gravity_B_m_per_s2);
  /// Torque of each joint [N·m, N] per unit of each change of link `link`, joints × columns; rows after the
  /// link are zero.
  void torques(Eigen::Index link, const InertialChanges& changes, Eigen::MatrixXd& result_Nm) const;
  /// With these inertial parameters of each link.
  void torques(const std::vector<InertialVector>& links, Eigen::VectorXd& result_Nm) const;

 private:
  /// Of a link's frame, in its axes.
  struct Motion {
    Eigen::Matrix3d R_PL;
    Eigen::Vector3d p_PL_m;
    Eigen::Vector3d w_rad_per_s;
    Eigen::Vector3d alpha_rad_per_s2;
    Eigen::Vector3d a_m_per_s2;  ///< of the origin, less gravity
  };
  double joint_torque(std::size_t joint, const Eigen::Vector3d& force_N,
                      const Eigen::Vector3d& moment_Nm) const {
    const control::ArmLink& link = links_[joint];
    return link.axis_L.dot(link.slides ? force_N : moment_Nm);
  }

  std::vector<control::ArmLink> links_;
  std::vector<Motion> motion_;
};

}  // namespace identification::robot_gap
