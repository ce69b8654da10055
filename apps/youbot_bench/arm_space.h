/// @file
/// Where the arm may be: clear of its own base and of the floor.
#pragma once
#include <Eigen/Core>
#include <Eigen/Geometry>

#include "control/serial_arm.h"

namespace youbot_bench {

/// Balls around tip, wrist, and joints 3 and 4 are clear of the shapes from which control::ArmProtection
/// pushes the arm away: the base, the arm's foot and the floor. Nothing else is known of the surroundings.
/// Const functions are thread-safe.
class ArmSpace {
 public:
  ArmSpace();
  /// `q_rad`: of the five joints.
  bool is_clear(const Eigen::VectorXd& q_rad) const;

 private:
  bool is_clear_at(const Eigen::Vector3d& p_B_m, double radius_m) const;

  control::SerialArm arm_;  // from B on
};

}  // namespace youbot_bench
