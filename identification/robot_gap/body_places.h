/// @file
/// Whether centres of mass lie where the bodies of an arm can have them.
#pragma once
#include <string>
#include <vector>

#include "control/arm_description.h"

namespace identification::robot_gap {

/// A sentence for each link, and the payload, whose centre was moved to a place beyond its reach: of a link,
/// one and a half times its length or the distance that its given centre has from the joint, whichever is
/// larger; of the payload, the length of the whole arm from the tip. A fit ends there when another cause
/// stands behind the torque.
std::vector<std::string> implausible_places(const control::ArmDescription& given,
                                            const control::ArmDescription& changed);

}  // namespace identification::robot_gap
