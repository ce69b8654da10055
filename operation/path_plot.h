/// @file
/// Paths of base and end effector in a plane, with the workspace limits.
#pragma once
#include <Eigen/Core>
#include <string>
#include <vector>

#include "control/workspace.h"
#include "report/report.h"

namespace operation {

/// Of the plane of x and the axis `up` (1 y, 2 z) in W; both axes have the same scale.
report::Plot path_plot(const std::string& title, Eigen::Index up, std::vector<report::Series> paths);
/// Dashed. A side without a limit ends where the paths of the plot end.
void add_base_limits(report::Plot& plot, const control::Workspace& workspace);
void add_end_effector_limits(report::Plot& plot, Eigen::Index up, const control::Workspace& workspace);

}  // namespace operation
