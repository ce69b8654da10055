#include "control/planar.h"

#include <cmath>

namespace control {

PlanarPose moved_by(const PlanarPose& X_WB, const PlanarVector& displacement_B) noexcept {
  const double turn = displacement_B[2];
  // sin(t)/t and (1 - cos t)/t; the half angle keeps the precision that 1 - cos t loses at small t, and below
  // 1e-4 two terms of the series are exact.
  double a = 1 - turn * turn / 6;
  double b = turn / 2 * (1 - turn * turn / 12);
  if (std::abs(turn) > 1e-4) {
    const double half_sine = std::sin(turn / 2);
    a = std::sin(turn) / turn;
    b = 2 * half_sine * half_sine / turn;
  }
  const PlanarVector chord_B(a * displacement_B[0] - b * displacement_B[1],
                             b * displacement_B[0] + a * displacement_B[1], turn);
  const PlanarVector chord_W = rotated(chord_B, X_WB.yaw_rad);
  return {X_WB.x_m + chord_W[0], X_WB.y_m + chord_W[1], X_WB.yaw_rad + turn};
}

PlanarVector rotated(const PlanarVector& v, double angle_rad) noexcept {
  return rotated(v, std::cos(angle_rad), std::sin(angle_rad));
}

}  // namespace control
