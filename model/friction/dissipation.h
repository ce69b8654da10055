/// @file
/// Checks that friction brakes at all speeds in use.
#pragma once
#include <functional>
#include <optional>

namespace model::friction {

/// The velocity nearest to rest, within `top_speed_rad_per_s` in either direction, at which friction drives
/// the joint, v·τ(v) < 0; empty if it never supplies energy. Checks 2000 speeds in either direction. A curve
/// that bends down usually does so beyond the measured speeds. Setup.
std::optional<double> driving_velocity_rad_per_s(
    const std::function<double(double velocity_rad_per_s)>& friction_Nm, double top_speed_rad_per_s);

}  // namespace model::friction
