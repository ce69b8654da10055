/// @file
/// Whether centres of mass lie where the bodies of an arm can have them.
#pragma once
#include <string>
#include <vector>

#include "control/arm_description.h"

namespace identification::robot_gap {

/// A sentence for each link, and the payload, whose centre was moved to a place beyond its reach. The reach
/// of a link, from its joint, is one and a half times the larger of two lengths: its own, and the distance of
/// its given centre from the joint. The reach of the payload, from the tip, is the length of the whole arm. A
/// fit ends there when another cause stands behind the torque.
std::vector<std::string> implausible_places(const control::ArmDescription& given,
                                            const control::ArmDescription& changed);

}  // namespace identification::robot_gap
