/// @file
/// The comparison of measured and predicted torques, row by row, with the derivative by every term.
#pragma once
#include <Eigen/Core>
#include <span>
#include <vector>

#include "control/arm_description.h"
#include "identification/robot_gap/arm_motion.h"
#include "identification/robot_gap/arm_terms.h"
#include "identification/robot_gap/subject.h"

namespace identification::robot_gap {

/// Of recorded torques, which is fitted and no part of a model.
inline constexpr double kLongestLag_s = 0.02;

/// Rows in which the joint, a channel, moves: at rest, friction is any torque up to its breakaway. The ends
/// of a recording are left out, where the filters have seen one side only.
RowPlan plan_rows(std::span<const ArmMotion> motions, std::span<const double> rest_speed_rad_per_s,
                  double block_s);

/// Of each joint: below this speed it may be at rest, by its top speed and by the noise of its position.
std::vector<double> rest_speeds_rad_per_s(std::span<const ArmMotion> motions,
                                          std::span<const ArmRecording> recordings, double band_Hz);

/// 95 % of each joint's speeds over all motions are below this.
std::vector<double> top_speeds_rad_per_s(std::span<const ArmMotion> motions);

/// Torques [N·m] with the description's parameters; columns of `terms` alone.
ComparedRows compare(const control::ArmDescription& arm, std::span<const ArmMotion> motions,
                     const RowPlan& plan, std::span<const ArmTerm> terms);

/// Reported torques of all joints in the samples of a motion, not yet in the band.
Eigen::MatrixXd predicted_torque_Nm(const control::ArmDescription& arm, const ArmMotion& motion);

}  // namespace identification::robot_gap
