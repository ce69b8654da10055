/// @file
/// The emulated Falcon's own mechanics, worked out apart from the driver's: thigh angles by the half-angle
/// form, torques to force by virtual work over numeric differences. Metres, radians; z out towards the user.
/// Dimensions and closure of the legs: R. E. Stamper's thesis (1997) and libnifalcon, FalconGeometry.h.
#pragma once
#include <array>

namespace sim::devices {

using FalconVector = std::array<double, 3>;

/// Not finite where the legs do not reach.
FalconVector falcon_thigh_angles_rad(const FalconVector& grip_m) noexcept;

/// The force on the hand that does, for every small motion, the work that the torques do on the thighs.
FalconVector falcon_force_N(const FalconVector& grip_m, const FalconVector& torques_Nm) noexcept;

}  // namespace sim::devices
