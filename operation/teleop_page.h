/// @file
/// The page of a teleoperation.
#pragma once
#include <memory>

#include "control/teleoperation.h"
#include "hal/robot.h"
#include "operation/run_report.h"
#include "operation/teleop_run.h"

namespace operation {

/// `robot` must outlive it.
std::unique_ptr<RunReport<TeleopRecord, TeleopSummary>> teleop_report(
    const control::Teleoperation::Config& config, const hal::Robot& robot);

}  // namespace operation
