/// @file
/// Bounds on what a controller may ask for. Limiting is not a fault: the motion goes on, and it is told.
#pragma once
#include "control/link_map.h"
#include "control/planar.h"

namespace control {

/// Defaults: a hand can hold the base back.
struct WrenchLimits {
  double force_N = 5.0;
  double moment_Nm = 1.0;
};

template <class Vector>
struct Limited {
  Vector value;
  bool limited = false;
};

/// Shortens the force to its limit keeping its direction; bounds the moment on its own. Cycle: pure.
Limited<PlanarVector> limited_wrench(const PlanarVector& wrench, const WrenchLimits& limits) noexcept;

/// Scales all four torques down together until the largest fits, so that the wrench keeps its direction.
Limited<WheelVector> limited_torque(const WheelVector& torque_Nm, double limit_Nm) noexcept;

}  // namespace control
