/// @file
/// Motion of an arm's links from the measured motion of its motors, and the torque that it takes.
#pragma once
#include <Eigen/Core>
#include <vector>

#include "control/arm_description.h"
#include "identification/robot_gap/arm_motion.h"
#include "identification/robot_gap/rigid_arm.h"

namespace identification::robot_gap {

/// Joints × samples of a motion.
struct LinkMotion {
  Eigen::MatrixXd q_rad;
  Eigen::MatrixXd v_rad_per_s;
  Eigen::MatrixXd a_rad_per_s2;
  Eigen::MatrixXd rigid_Nm;  ///< torque of the links and the payload
};

/// With the encoders' zeros, and behind elastic gears. The deflection follows the torque at once: below the
/// resonance of link and gear.
LinkMotion link_motion(const control::ArmDescription& arm, const ArmMotion& motion);

/// Of all links, the payload in the last one's.
std::vector<InertialVector> inertial_vectors(const control::ArmDescription& arm);

}  // namespace identification::robot_gap
