/// @file
/// The floor under a simulated base: level or sloping, with places of their own.
#pragma once
#include <Eigen/Core>
#include <vector>

namespace sim {

/// A rectangle along the axes of W. Where some overlap, the last one counts.
struct FloorPatch {
  Eigen::Vector2d from_m = Eigen::Vector2d::Zero();
  Eigen::Vector2d to_m = Eigen::Vector2d::Zero();
  double grip = 1;        ///< factor on the friction coefficient along a roller's axis: wet, dusty
  double resistance = 1;  ///< factor on the rolling resistance of a roller: carpet

  bool contains(double x_m, double y_m) const noexcept {
    return x_m >= from_m.x() && x_m < to_m.x() && y_m >= from_m.y() && y_m < to_m.y();
  }
};

struct Floor {
  Eigen::Vector2d slope_W = Eigen::Vector2d::Zero();  ///< rise per metre along x and y; wheel loads and the
                                                      ///< arm's weight stay as on a level floor
  std::vector<FloorPatch> patches{};

  bool is_plain() const noexcept { return patches.empty() && slope_W.isZero(); }
};

}  // namespace sim
