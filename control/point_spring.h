/// @file
/// A virtual spring and damper between the handle of a haptic device and a point.
#pragma once
#include <Eigen/Core>

namespace control {

struct PointSpring {
  double stiffness_N_per_m = 40.0;  ///< the thesis' centring spring (3.4)
  double damping_N_s_per_m = 0.5;

  /// On the handle: k (p_point - p) - d v. A loop of period T generates no energy if the device's own damping
  /// exceeds k T / 2 + d (Colgate and Schenkel, J. Robotic Systems 14:37, 1997).
  Eigen::Vector3d force_N(const Eigen::Vector3d& p_point_m, const Eigen::Vector3d& p_m,
                          const Eigen::Vector3d& v_m_per_s) const noexcept {
    return stiffness_N_per_m * (p_point_m - p_m) - damping_N_s_per_m * v_m_per_s;
  }
};

}  // namespace control
