/// @file
/// Commanded against measured velocity: drives whose torque nobody commands, because a speed loop inside
/// does.
#pragma once
#include <optional>
#include <span>

#include "identification/gap/gap.h"
#include "identification/gap/signals.h"
#include "model/effects/drive_model.h"

namespace identification::gap {

/// The time by which velocity follows its command beyond any lag: the response without it may be any of
/// second order, with droop, friction and offset,
///
///   v = g·y(u) + c·y(sign u) + o,   y: ω²/(s² + 2ζωs + ω²)
///
/// Empty where no velocity command was recorded, and where a torque command was: then that channel says it.
/// Gaps are in torque: what inertia and friction of `base` make of the misfit of velocity.
std::optional<FoundEffect> speed_command_delay(std::span<const Signals> signals,
                                               const model::effects::DriveModel& base,
                                               const Options& options);

}  // namespace identification::gap
