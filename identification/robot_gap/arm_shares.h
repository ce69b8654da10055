/// @file
/// Where a model and recordings of an arm part: by joint, speed, direction, pose, load and time.
#pragma once
#include <Eigen/Core>
#include <vector>

#include "identification/robot_gap/arm_search.h"
#include "identification/robot_gap/robot_gap.h"

namespace identification::robot_gap {

/// Shares of the squared residual [N²·m²], of one joint in all of it and within each joint of each range.
std::vector<Share> shares_of(const Eigen::VectorXd& before_Nm, const Eigen::VectorXd& after_Nm,
                             const Eigen::VectorXd& predicted_Nm, const ArmData& data,
                             const control::ArmDescription& arm);

/// A stretch of each recording and joint, for plots.
std::vector<RobotTrace> traces_of(const Eigen::VectorXd& measured_Nm, const Eigen::VectorXd& before_Nm,
                                  const Eigen::VectorXd& after_Nm, const ArmData& data,
                                  const control::ArmDescription& arm);

}  // namespace identification::robot_gap
