/// @file
/// Whether friction brakes, at all speeds it is used at.
#pragma once
#include <functional>
#include <optional>

namespace model::friction {

/// The velocity nearest to rest, not beyond `top_speed_rad_per_s` in either direction, at which friction
/// drives the joint, v·τ(v) < 0; none where it takes energy everywhere or nothing. Looks at 2000 speeds of
/// either direction. A curve that bends down does so beyond the speeds that were measured. Setup.
std::optional<double> driving_velocity_rad_per_s(
    const std::function<double(double velocity_rad_per_s)>& friction_Nm, double top_speed_rad_per_s);

}  // namespace model::friction
