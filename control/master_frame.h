/// @file
/// The operator looks along W's x: between a master's frame H (x towards him, y to his right, z up;
/// hal/haptic_sample.h) and the robot's W (x forward, y left, z up) lies half a turn about z (thesis 3.4.1).
#pragma once
#include <Eigen/Core>
#include <Eigen/Geometry>

namespace control {

/// The same vector or rotation in the other frame, either way.
inline Eigen::Vector3d turned_H_W(const Eigen::Vector3d& v) noexcept { return {-v.x(), -v.y(), v.z()}; }
inline Eigen::Quaterniond turned_H_W(const Eigen::Quaterniond& q) noexcept {
  return {q.w(), -q.x(), -q.y(), q.z()};
}

}  // namespace control
