/// @file
/// The combinations of an arm's inertial parameters that act on its torques.
#pragma once
#include <Eigen/Core>
#include <string>
#include <vector>

#include "control/arm_description.h"

namespace identification::robot_gap {

/// Of all inertial parameters of links and rotors only some combinations act on torques: the base parameters.
/// One is a parameter plus multiples of others that act alike. Found numerically, by a QR decomposition of
/// the torques in random states. [M. Gautier, "Numerical calculation of the base inertial parameters of
/// robots", J. Robotic Systems 8(4), 1991]
class BaseParameters {
 public:
  /// The geometry of `arm` determines the combinations, whatever its inertial parameters.
  explicit BaseParameters(const control::ArmDescription& arm);

  Eigen::Index count() const noexcept { return combine_.rows(); }
  /// "inertia_zz_kg_m2 of upper_arm, with 4 others"
  const std::vector<std::string>& names() const noexcept { return names_; }
  Eigen::VectorXd of(const control::ArmDescription& arm) const;
  /// count × all parameters: those of each link as InertialVector, then the rotors.
  const Eigen::MatrixXd& combinations() const noexcept { return combine_; }

 private:
  Eigen::MatrixXd combine_;
  std::vector<std::string> names_;
};

/// In the order of BaseParameters::combinations().
Eigen::VectorXd inertial_parameters(const control::ArmDescription& arm);

}  // namespace identification::robot_gap
