/// @file
/// The measures of a teleoperation as a section of a page.
#pragma once
#include <vector>

#include "operation/teleop_measures.h"
#include "operation/teleop_run.h"
#include "report/report.h"

namespace operation {

/// Completion time, forces, match of the workspaces, and the human limits that are met or missed. Without
/// operation there is nothing to add.
void add_measures(report::Page& page, const TeleopMeasures& measures, const std::vector<TaskReport>& tasks);
/// The same in a section that the page has already.
void add_measure_tables(report::Page& page, const TeleopMeasures& measures,
                        const std::vector<TaskReport>& tasks);

}  // namespace operation
