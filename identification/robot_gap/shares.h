/// @file
/// Where a model and recordings of a robot part: by channel, by the coordinates of the subject, and in time.
#pragma once
#include <Eigen/Core>
#include <vector>

#include "identification/robot_gap/robot_gap.h"
#include "identification/robot_gap/search.h"

namespace identification::robot_gap {

/// Shares of the squared residual in noise floors: of each channel in all of it, and in ranges of each
/// coordinate.
std::vector<Share> shares_of(const Eigen::VectorXd& before, const Eigen::VectorXd& after, const View& view);

/// A stretch of each recording and channel, for plots.
std::vector<RobotTrace> traces_of(const Eigen::VectorXd& measured, const Eigen::VectorXd& before,
                                  const Eigen::VectorXd& after, const View& view);

}  // namespace identification::robot_gap
