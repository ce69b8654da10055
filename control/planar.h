/// @file
/// Motion in the plane of the floor. Planar vectors are ordered x, y, yaw: a twist is [m/s, m/s, rad/s], a
/// displacement [m, m, rad], a wrench [N, N, N·m].
///
/// Frames: W is the fixed frame the base started in, B the base: x forward, y left, z up, origin midway
/// between the four wheels. Yaw is positive counter-clockwise seen from above and never wrapped.
#pragma once
#include <Eigen/Core>

namespace control {

using PlanarVector = Eigen::Vector3d;

struct PlanarPose {
  double x_m = 0.0;
  double y_m = 0.0;
  double yaw_rad = 0.0;
};

/// The pose after a displacement at constant body twist, expressed in the base frame at its start
/// (exponential map of SE(2)): (1, 0, 0) drives 1 m ahead, (2πr, 0, 2π) a full circle of radius r to the
/// left.
PlanarPose moved_by(const PlanarPose& X_WB, const PlanarVector& displacement_B) noexcept;

/// Turns a planar vector by `angle_rad`; the yaw component stays.
PlanarVector rotated(const PlanarVector& v, double angle_rad) noexcept;
/// As above, with the cosine and sine of the angle, to rotate several vectors by one angle.
inline PlanarVector rotated(const PlanarVector& v, double cosine, double sine) noexcept {
  return {cosine * v[0] - sine * v[1], sine * v[0] + cosine * v[1], v[2]};
}

}  // namespace control
