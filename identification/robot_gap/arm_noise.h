/// @file
/// The torque that no model of an arm predicts.
#pragma once
#include <Eigen/Core>
#include <span>

#include "control/arm_description.h"
#include "identification/robot_gap/arm_motion.h"

namespace identification::robot_gap {

/// Rms of each joint's residual in the rows of the comparison, from the noise of the torque sensors and of
/// the measured positions [N·m].
Eigen::VectorXd noise_floor_Nm(const control::ArmDescription& arm, std::span<const ArmRecording> recordings,
                               double band_Hz);

}  // namespace identification::robot_gap
