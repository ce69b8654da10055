/// @file
/// The parameters that a fit of a whole arm changes, and how far they may be off before it.
#pragma once
#include <vector>

#include "control/arm_description.h"
#include "identification/robot_gap/arm_terms.h"

namespace identification::robot_gap {

struct ArmParameter {
  ArmTerm term;
  double sigma = 0;  ///< standard deviation of the given value, in its unit
};

/// Mass, centre and rotational inertia of each link that has them, rotor, friction and offset of each drive.
/// The deviations are wide for what motions determine, so that they matter for the rest alone.
std::vector<ArmParameter> arm_parameters(const control::ArmDescription& arm);

}  // namespace identification::robot_gap
