/// @file
/// Effects that a set of recordings could not show.
#pragma once
#include <span>
#include <string_view>
#include <vector>

#include "identification/gap/gap.h"
#include "identification/gap/signals.h"

namespace identification::gap {

/// One for each group of effects that the search cannot find in this data, present or not, with the recording
/// that would show it. `rests` is false if nothing rested under a changing torque.
std::vector<BlindSpot> blind_spots(std::span<const Signals> signals, bool rests);

/// An effect that is common in such a drive, with a relevant size.
model::effects::AnyEffect usual_effect(std::string_view effect, const model::effects::DriveModel& model,
                                       double resolution_rad);

}  // namespace identification::gap
