/// @file
/// The pose that would show which of two models of an arm is right.
#pragma once
#include <Eigen/Core>
#include <cstdint>
#include <span>
#include <string>

#include "control/arm_description.h"
#include "identification/robot_gap/arm_motion.h"

namespace identification::robot_gap {

/// The poses in which two arms differ most, in words: states at random in the range of motion seen and half
/// of it beyond, with the speeds seen. `floor_Nm`: of each joint, what noise alone leaves.
std::string deciding_pose(const control::ArmDescription& one, const control::ArmDescription& other,
                          std::span<const ArmMotion> motions, const Eigen::VectorXd& floor_Nm,
                          std::uint64_t seed);

}  // namespace identification::robot_gap
