/// @file
/// Checks that the friction of a drive model brakes.
#pragma once
#include <optional>
#include <span>
#include <vector>

#include "model/effects/drive_model.h"

namespace model::effects {

/// Default speed limit of a youBot's wheel.
inline constexpr double kUsualTopSpeed_rad_per_s = 12.0;

/// The velocity nearest to rest, up to the top speed in either direction, at which the friction effects
/// together would drive the joint, cold or warm. A simulated drive has no friction there, and a compensation
/// with such a model is wrong at all speeds beyond. See model::friction::driving_velocity_rad_per_s().
std::optional<double> driving_velocity_rad_per_s(const DriveModel& model, double top_speed_rad_per_s);

/// The effects with friction that depends on the position at its least, wherever the joint is.
std::vector<AnyEffect> with_least_friction(std::span<const AnyEffect> effects);

}  // namespace model::effects
