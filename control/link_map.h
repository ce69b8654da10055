/// @file
/// Four mecanum wheels as one virtual planar joint (thesis 2.7.2).
#pragma once
#include <Eigen/Core>

#include "control/planar.h"

namespace control {

/// Wheels in bus order: 1 front-left, 2 front-right, 3 rear-left, 4 rear-right.
using WheelVector = Eigen::Vector4d;

/// Sign convention of the wheels.
enum class WheelSigns {
  /// All four positive turn the base counter-clockwise: the thesis, the motor controllers on the wire, and
  /// the official C++ driver (its kinematics has the thesis' signs; the two differ by geometric factors).
  kCounterClockwise,
  /// All four positive drive forward: the ROS interface and robot description of the official driver, which
  /// invert the sign of the left wheels.
  kForward,
};

/// Configuration of the official driver, youbot-base.cfg. Other sources give radii of 0.050 m and 0.052 m.
struct BaseGeometry {
  double wheel_radius_m = 0.0475;
  double wheelbase_m = 0.47;  ///< front to rear axle
  double track_m = 0.30;      ///< left to right wheel
};

/// Maps twists and wrenches of the base to wheel speeds and torques. With M the 3×4 matrix of twist():
///   V = M·w,  τ = Mᵀ·W,  so that τ·w = W·V for every wheel motion w (power is conserved),
///   w = M⁺·V (rolling without slip),  W = (Mᵀ)⁺·τ (resultant of the wheel torques).
/// Rows of M for kCounterClockwise, up to the factors: x [−1 1 −1 1], y [1 1 −1 −1], yaw [1 1 1 1].
/// Pure after construction; cycle-safe.
class LinkMap {
 public:
  /// The thesis' map: entries are ±1, no geometry, so "twists" are sums of wheel speeds.
  static LinkMap without_geometry(WheelSigns signs = WheelSigns::kCounterClockwise);
  /// Metric twists and wrenches. @throws std::invalid_argument on a length that is not finite and positive.
  static LinkMap with_geometry(const BaseGeometry& geometry,
                               WheelSigns signs = WheelSigns::kCounterClockwise);

  PlanarVector twist(const WheelVector& wheel_velocity) const noexcept { return M_ * wheel_velocity; }
  WheelVector wheel_velocity(const PlanarVector& twist) const noexcept { return M_inverse_ * twist; }
  WheelVector wheel_torque(const PlanarVector& wrench) const noexcept { return M_.transpose() * wrench; }
  PlanarVector wrench(const WheelVector& wheel_torque) const noexcept {
    return M_inverse_.transpose() * wheel_torque;
  }

 private:
  LinkMap(const PlanarVector& row_scale, WheelSigns signs);

  Eigen::Matrix<double, 3, 4> M_;
  Eigen::Matrix<double, 4, 3> M_inverse_;
};

}  // namespace control
