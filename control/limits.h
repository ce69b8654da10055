/// @file
/// Limits on controller outputs. Limiting is not a fault: the motion continues and the limit is reported.
#pragma once
#include "control/link_map.h"
#include "control/planar.h"

namespace control {

/// Defaults: a hand can hold the base against them.
struct WrenchLimits {
  double force_N = 5.0;
  double moment_Nm = 1.0;
};

template <class Vector>
struct Limited {
  Vector value;
  bool limited = false;
};

/// Scales the force down to its limit, keeping its direction; limits the moment independently. Cycle: pure.
Limited<PlanarVector> limited_wrench(const PlanarVector& wrench, const WrenchLimits& limits) noexcept;

/// Scales all four torques together until the largest is within the limit, so that the wrench keeps its
/// direction.
Limited<WheelVector> limited_torque(const WheelVector& torque_Nm, double limit_Nm) noexcept;

}  // namespace control
