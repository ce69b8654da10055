/// @file
/// Boundary in a haptic device's workspace between position control and rate control (thesis 3.4.3).
#pragma once
#include <Eigen/Core>
#include <algorithm>

namespace control {

/// A spheroid cut by two planes, in the device's frame H. Defaults: fitted to an omega.6 by the thesis.
///
/// Beyond it a weak spring, which the thesis does not have, pushes the handle back: the hand feels where rate
/// control begins, and a released handle does not stay outside.
struct RateBoundary {
  Eigen::Vector3d centre_H_m{-0.08, 0.0, 0.008};
  Eigen::Vector3d half_axes_m{0.14, 0.10, 0.10};
  double least_x_m = -0.042;
  double least_z_m = -0.066;
  double rim_N_per_m = 60.0;

  bool inside(const Eigen::Vector3d& p_HD_m) const noexcept {
    return (p_HD_m - centre_H_m).cwiseQuotient(half_axes_m).squaredNorm() < 1 && p_HD_m.x() > least_x_m &&
           p_HD_m.z() > least_z_m;
  }

  /// Gradient of the potential ½·k·d² over each of the three surfaces. The depth d outside the spheroid is
  /// measured along its shortest half axis a: d = (ρ − 1)·a with ρ = |(p − c)/axes|.
  Eigen::Vector3d rim_force_H_N(const Eigen::Vector3d& p_HD_m) const noexcept {
    Eigen::Vector3d force_H_N(rim_N_per_m * std::max(0.0, least_x_m - p_HD_m.x()), 0,
                              rim_N_per_m * std::max(0.0, least_z_m - p_HD_m.z()));
    const Eigen::Vector3d scaled = (p_HD_m - centre_H_m).cwiseQuotient(half_axes_m);
    const double rho = scaled.norm();
    const double shortest_m = half_axes_m.minCoeff();
    if (rho > 1)
      force_H_N -=
          rim_N_per_m * (rho - 1) * shortest_m * shortest_m / rho * scaled.cwiseQuotient(half_axes_m);
    return force_H_N;
  }
};

}  // namespace control
