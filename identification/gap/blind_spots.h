/// @file
/// Effects that a set of recordings could not have shown.
#pragma once
#include <span>
#include <string_view>
#include <vector>

#include "identification/gap/gap.h"
#include "identification/gap/signals.h"

namespace identification::gap {

/// One for each group of effects that the search cannot have found in this data, whether it is there
/// or not, with the recording that would show it. Where `rests` is false, nothing rested under a changing
/// torque.
std::vector<BlindSpot> blind_spots(std::span<const Signals> signals, bool rests);

/// An effect that such a drive often has, in a size that is worth knowing.
model::effects::AnyEffect usual_effect(std::string_view effect, const model::effects::DriveModel& model,
                                       double resolution_rad);

}  // namespace identification::gap
