/// @file
/// The emulated Falcon's own mechanics, independent of the driver's: thigh angles by the half-angle form,
/// torques to force by virtual work with numeric differences. Metres, radians; z out towards the user.
/// Dimensions and closure of the legs: R. E. Stamper's thesis (1997) and libnifalcon, FalconGeometry.h.
#pragma once
#include <array>

namespace sim::devices {

using FalconVector = std::array<double, 3>;

/// Not finite outside the reach of the legs.
FalconVector falcon_thigh_angles_rad(const FalconVector& grip_m) noexcept;

/// The force on the hand that does the same work as the torques on the thighs, for every small motion.
FalconVector falcon_force_N(const FalconVector& grip_m, const FalconVector& torques_Nm) noexcept;

}  // namespace sim::devices
