/// @file
/// Whether the recorded torques of wheels have the sign of their motion.
#pragma once
#include <span>
#include <string>
#include <vector>

#include "control/base_description.h"
#include "identification/robot_gap/base_effort_windows.h"

namespace identification::robot_gap {

/// Fits each wheel's torque by friction, inertia, slope and resistances. Signs of the whole torque say
/// little: on a slope it is positive both ways, and downhill it brakes. Returns what looks odd but can be
/// compared, in words.
/// @throws std::invalid_argument naming the wheel and the remedy if its torque is zero, a magnitude, or has
/// the wrong sign: no parameter corrects these.
std::vector<std::string> check_torque_signs(const control::BaseDescription& given,
                                            std::span<const std::vector<EffortWindow>> windows);

}  // namespace identification::robot_gap
