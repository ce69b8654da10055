/// @file
/// The summary as text.
#pragma once
#include <string>

#include "operation/session.h"
#include "operation/teleop_session.h"

namespace operation {

/// Figures of a run, several lines, each with a line end. Errors are logged separately (main.cpp).
std::string report(const Summary& summary);
std::string report(const TeleopSummary& summary);

/// "done"
const char* result_text(sim::TaskResult result);

/// The part common to all runs: the loop's figures, and the reports of robot, system and recording.
std::string report_of_any_run(const RunSummary& summary);

/// Two runs of one motion, side by side, each under its name.
std::string side_by_side(const std::string& title, const std::string& left_name, const Summary& left,
                         const std::string& right_name, const Summary& right);

/// The same motion without and with friction compensation, side by side, with the conclusion.
std::string compare(const Summary& without, const Summary& with);

}  // namespace operation
