/// @file
/// The operator looks along W's x: the frame H of a haptic device (x towards the operator, y to the
/// operator's right, z up; hal/haptic_sample.h) is rotated by half a turn about z against the robot's W (x
/// forward, y left, z up) (thesis 3.4.1).
#pragma once
#include <Eigen/Core>
#include <Eigen/Geometry>

namespace control {

/// The same vector or rotation in the other frame; the mapping is its own inverse.
inline Eigen::Vector3d turned_H_W(const Eigen::Vector3d& v) noexcept { return {-v.x(), -v.y(), v.z()}; }
inline Eigen::Quaterniond turned_H_W(const Eigen::Quaterniond& q) noexcept {
  return {q.w(), -q.x(), -q.y(), q.z()};
}

}  // namespace control
