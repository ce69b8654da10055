/// @file
/// Friction and position-dependent torque of a joint, as far as a compensator can act on them.
#pragma once
#include "model/friction/sliding_table.h"
#include "model/position_torque.h"

namespace model {

struct JointResistance {
  friction::SlidingTable sliding;  ///< friction against velocity, with the breakaway torque at rest
  PositionTorque position{};
  double least_torque_Nm = 0;  ///< delivered for every smaller command; see DeadbandModulator
};

}  // namespace model
