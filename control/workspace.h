/// @file
/// Where base and end effector may be.
#pragma once
#include <Eigen/Geometry>
#include <limits>

namespace control {

/// Boxes in W, which is where the base stood at the start, on the floor; the base's by its centre, without
/// its corners. Set-points are held at the walls. What gets further out than kMargin_m all the same, because
/// it is pushed or its odometry slips, is stopped; a base that is further out already when it is enabled,
/// that much beyond where it stands then. Unbounded where nothing is said.
struct Workspace {
  static constexpr double kMargin_m = 0.05;
  static constexpr double kUnbounded_m = std::numeric_limits<double>::infinity();

  Eigen::AlignedBox2d base_W_m{Eigen::Vector2d::Constant(-kUnbounded_m),
                               Eigen::Vector2d::Constant(kUnbounded_m)};
  Eigen::AlignedBox3d tip_W_m{Eigen::Vector3d::Constant(-kUnbounded_m),
                              Eigen::Vector3d::Constant(kUnbounded_m)};
};

/// The nearest place in the box, or how far outside it a place is [m]. Cycle: pure. Not AlignedBox' own
/// distance, which is not a number when the box is unbounded.
template <int kAxes>
Eigen::Matrix<double, kAxes, 1> held_in(const Eigen::AlignedBox<double, kAxes>& box_m,
                                        const Eigen::Matrix<double, kAxes, 1>& p_m) noexcept {
  return p_m.cwiseMax(box_m.min()).cwiseMin(box_m.max());
}
template <int kAxes>
double outside_m(const Eigen::AlignedBox<double, kAxes>& box_m,
                 const Eigen::Matrix<double, kAxes, 1>& p_m) noexcept {
  return (p_m - held_in(box_m, p_m)).norm();
}

}  // namespace control
