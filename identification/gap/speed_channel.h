/// @file
/// Commanded against measured velocity: drives whose torque is commanded by an internal speed loop.
#pragma once
#include <optional>
#include <span>

#include "identification/gap/gap.h"
#include "identification/gap/signals.h"
#include "model/effects/drive_model.h"

namespace identification::gap {

/// The delay by which velocity follows its command beyond any lag: the response without it may be any of
/// second order, with droop, friction and offset,
///
///   v = g·y(u) + c·y(sign u) + o,   y: ω²/(s² + 2ζωs + ω²)
///
/// Empty if no velocity command was recorded, or if a torque command was: then that channel shows it. Gaps
/// are in torque: the misfit of velocity, converted by inertia and friction of `base`.
std::optional<FoundEffect> speed_command_delay(std::span<const Signals> signals,
                                               const model::effects::DriveModel& base,
                                               const Options& options);

}  // namespace identification::gap
