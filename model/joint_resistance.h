/// @file
/// What keeps a joint from moving as its torque wants, as far as a compensator can act on it.
#pragma once
#include "model/friction/sliding_table.h"
#include "model/position_torque.h"

namespace model {

struct JointResistance {
  friction::SlidingTable sliding;  ///< friction against velocity, with the break-away torque at rest
  PositionTorque position{};
  double least_torque_Nm = 0;  ///< what the actuator makes of every smaller torque; see SmallTorques
};

}  // namespace model
