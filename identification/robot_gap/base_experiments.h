/// @file
/// Which motion of a base would decide between two explanations.
#pragma once
#include <Eigen/Core>
#include <string>
#include <vector>

#include "control/base_description.h"

namespace identification::robot_gap {

/// What a base has been seen to do, and how well that is measured.
struct SeenMotion {
  const control::BaseDescription& given;
  double speed_m_per_s = 0;
  double turn_rad_per_s = 0;
  double window_s = 0;
  std::vector<double> load{};   ///< of each wheel; empty: not measured
  Eigen::VectorXd noise_floor;  ///< forward, sideways, heading
};

/// Straight on, sideways, turns, squares and circles at the seen speeds, on every floor: the one in which the
/// two differ most, and by how much. "none: ..." if they differ in none.
std::string deciding_motion(const control::BaseDescription& one, const control::BaseDescription& other,
                            const SeenMotion& seen);

/// The same by the forces on the base, while it speeds up or moves steadily, on every floor. `force_floor`:
/// [N, N, N·m].
std::string deciding_force(const control::BaseDescription& one, const control::BaseDescription& other,
                           const SeenMotion& seen, const Eigen::Vector3d& force_floor);

}  // namespace identification::robot_gap
