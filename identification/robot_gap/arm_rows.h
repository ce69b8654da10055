/// @file
/// The comparison of measured and predicted torques, row by row, with the derivative by every term.
#pragma once
#include <Eigen/Core>
#include <span>
#include <vector>

#include "control/arm_description.h"
#include "identification/robot_gap/arm_motion.h"
#include "identification/robot_gap/arm_terms.h"

namespace identification::robot_gap {

/// A row is one joint at one time. Rows are in order of blocks; each block is a stretch of one recording.
struct RowPlan {
  struct Row {
    std::size_t motion = 0;
    Eigen::Index joint = 0;
    std::size_t at = 0;  ///< of the motion's rows
  };
  std::vector<Row> rows;
  std::vector<int> block;                 ///< of each row
  std::vector<std::size_t> block_motion;  ///< of each block
  std::vector<double> block_start_s;
  int blocks() const noexcept { return static_cast<int>(block_motion.size()); }
};

/// Rows in which the joint moves: at rest, friction is any torque up to its breakaway. The ends of a
/// recording are left out, where the filters have seen one side only.
RowPlan plan_rows(std::span<const ArmMotion> motions, std::span<const double> rest_speed_rad_per_s,
                  double block_s);

/// Of each joint: below this speed it may be at rest, by its top speed and by the noise of its position.
std::vector<double> rest_speeds_rad_per_s(std::span<const ArmMotion> motions,
                                          std::span<const ArmRecording> recordings, double band_Hz);

/// 95 % of each joint's speeds over all motions are below this.
std::vector<double> top_speeds_rad_per_s(std::span<const ArmMotion> motions);

struct ComparedRows {
  Eigen::VectorXd measured_Nm;
  Eigen::VectorXd predicted_Nm;
  Eigen::MatrixXd columns;  ///< derivative of the prediction by each term, N·m per unit
};

/// With the description's parameters. `terms` may be empty.
ComparedRows compare(const control::ArmDescription& arm, std::span<const ArmMotion> motions,
                     const RowPlan& plan, std::span<const Term> terms);

/// Reported torques of all joints in the samples of a motion, not yet in the band.
Eigen::MatrixXd predicted_torque_Nm(const control::ArmDescription& arm, const ArmMotion& motion);

}  // namespace identification::robot_gap
