/// @file
/// Motion of a described base from its wheels, and back.
#pragma once
#include <Eigen/Core>
#include <span>
#include <vector>

#include "control/base_description.h"
#include "control/planar.h"

namespace control {

/// Setup path; functions are pure and thread-safe.
class BaseRolling {
 public:
  /// Of the wheels over a short time. Angles may as well be speeds: all is linear in them.
  struct Wheels {
    std::span<const double> angle_rad;   ///< of each wheel
    std::span<const double> loaded_rad;  ///< angle times load, of each wheel; empty: no load
    double steering_rad = 0;             ///< as measured
    int floor = -1;                      ///< −1: none of the declared ones
  };

  /// @throws std::invalid_argument if the wheels do not determine the motion.
  explicit BaseRolling(const BaseDescription& base);

  /// Displacement of the base's centre in its own axes, at constant twist (moved_by()).
  PlanarVector displacement(const Wheels& wheels) const noexcept;

  /// Wheel angles that make a displacement without slip, and the measured steering angle for them. Motions
  /// that the kinematics excludes are ignored: sideways of a differential base or a tricycle.
  struct Turned {
    std::vector<double> angle_rad;
    double steering_rad = 0;
  };
  Turned wheels_for(const PlanarVector& displacement_B) const;

  /// Displacement of the tracked body in its own axes at the start, as it is measured, for one of the base.
  /// The third component is the change of heading, not wrapped.
  PlanarVector tracked(const PlanarPose& X_B0B1) const noexcept;

 private:
  BaseDescription base_;
  Eigen::Matrix<double, 3, Eigen::Dynamic>
      twist_;  // of the distances that the wheels roll; not of a tricycle
  Eigen::Matrix<double, Eigen::Dynamic, 3> rolling_;  // the way back
};

}  // namespace control
