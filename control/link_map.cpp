#include "control/link_map.h"

#include <cmath>
#include <stdexcept>
#include <string>

namespace control {
namespace {

double length(double value_m, const char* name) {
  if (std::isfinite(value_m) && value_m > 0) return value_m;
  throw std::invalid_argument(std::string("base geometry: ") + name + " must be finite and positive, not " +
                              std::to_string(value_m));
}

}  // namespace

LinkMap::LinkMap(const PlanarVector& row_scale, WheelSigns signs) {
  Eigen::Matrix<double, 3, 4> pattern;
  pattern << -1, 1, -1, 1,  //
      1, 1, -1, -1,         //
      1, 1, 1, 1;
  if (signs == WheelSigns::kForward) {
    pattern.col(0) *= -1;
    pattern.col(2) *= -1;
  }
  M_ = row_scale.asDiagonal() * pattern;
  // The rows are orthogonal with square length 4·scale², which makes the pseudo-inverse a scaled transpose.
  M_inverse_ = pattern.transpose() * (0.25 * row_scale.cwiseInverse()).asDiagonal();
}

LinkMap LinkMap::without_geometry(WheelSigns signs) { return {PlanarVector::Ones(), signs}; }

LinkMap LinkMap::with_geometry(const BaseGeometry& geometry, WheelSigns signs) {
  const double radius_m = length(geometry.wheel_radius_m, "wheel_radius_m");
  const double lever_m =
      (length(geometry.wheelbase_m, "wheelbase_m") + length(geometry.track_m, "track_m")) / 2;
  return {radius_m / 4 * PlanarVector(1, 1, 1 / lever_m), signs};
}

}  // namespace control
