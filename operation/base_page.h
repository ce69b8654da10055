/// @file
/// The page of a run of the base.
#pragma once
#include <memory>
#include <span>
#include <string>

#include "hal/robot.h"
#include "operation/base_run.h"
#include "operation/run_report.h"

namespace operation {

/// `experiment`: "path", "velocity" or "hold".
std::unique_ptr<RunReport<CycleRecord, Summary>> base_report(const Cycle::Config& config,
                                                             const std::string& experiment);

}  // namespace operation
