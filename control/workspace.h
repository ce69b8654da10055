/// @file
/// Workspace limits of base and end effector.
#pragma once
#include <Eigen/Geometry>
#include <limits>

namespace control {

/// Boxes in W, the floor frame where the base started; the base is checked by its centre, not its corners.
/// Set-points are held at the limits. Whatever is still further out than kMargin_m, pushed or by odometry
/// drift, is stopped; if the base is already further out when it is enabled, the margin counts from there.
/// Default: unbounded.
struct Workspace {
  static constexpr double kMargin_m = 0.05;
  static constexpr double kUnbounded_m = std::numeric_limits<double>::infinity();

  Eigen::AlignedBox2d base_W_m{Eigen::Vector2d::Constant(-kUnbounded_m),
                               Eigen::Vector2d::Constant(kUnbounded_m)};
  Eigen::AlignedBox3d tip_W_m{Eigen::Vector3d::Constant(-kUnbounded_m),
                              Eigen::Vector3d::Constant(kUnbounded_m)};
};

/// Nearest point in the box, and distance of a point outside it [m]. Cycle: pure. AlignedBox' own distance
/// returns NaN for an unbounded box.
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
