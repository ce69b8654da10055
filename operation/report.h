/// @file
/// The summary in words.
#pragma once
#include <string>

#include "operation/session.h"
#include "operation/teleop_session.h"

namespace operation {

/// Figures of a run, several lines, each ended. What went wrong is logged apart (main.cpp).
std::string report(const Summary& summary);
std::string report(const TeleopSummary& summary);

/// Of it what every run has: the loop's figures, and what robot, system and recording have to tell.
std::string report_of_any_run(const RunSummary& summary);

/// Two runs of one motion, side by side under the names of what differs.
std::string side_by_side(const std::string& title, const std::string& left_name, const Summary& left,
                         const std::string& right_name, const Summary& right);

/// The same motion without and with friction compensation, side by side, and what it shows.
std::string compare(const Summary& without, const Summary& with);

}  // namespace operation
