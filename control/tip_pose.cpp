#include "control/tip_pose.h"

#include <cmath>

namespace control {

Eigen::Vector3d rotation_between(const Eigen::Quaterniond& q_from, const Eigen::Quaterniond& q_to) noexcept {
  Eigen::Quaterniond q = q_to * q_from.conjugate();
  if (q.w() < 0) q.coeffs() = -q.coeffs();
  const double sine = q.vec().norm();  // of half the angle
  // Near zero the angle is twice the sine; a division would lose precision.
  return sine < 1e-9 ? Eigen::Vector3d(2 * q.vec())
                     : Eigen::Vector3d(2 * std::atan2(sine, q.w()) / sine * q.vec());
}

}  // namespace control
