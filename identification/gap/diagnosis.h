/// @file
/// Checks recordings before they are analysed: damage is repaired or cut out, and contradictions are
/// rejected.
#pragma once
#include <vector>

#include "identification/gap/gap.h"

namespace identification::gap {

struct Diagnosed {
  std::vector<Source> sources;  ///< repaired; one recording may have become several, or none
  std::vector<Diagnosis> diagnosis;
};

/// Wrapped positions are unwrapped, with their set-points: before anything is computed from them, such as the
/// torque of a servo.
void unwrap_positions(std::vector<Source>& sources, std::vector<Diagnosis>& diagnosis);

/// Wrapped positions are unwrapped. Jumps of position, long gaps in time and another rate of the rows divide
/// a recording. Single
/// torques far beyond all others are interpolated, only the fresh ones of held values are kept, and a dead
/// column is removed if another one contains the same quantity. Units and signs are checked for consistency
/// between columns, and against the inertia and friction of `base`.
/// @throws std::invalid_argument naming recording, column, likely cause and remedy, if one of these cannot be
/// repaired without a guess.
Diagnosed diagnose(std::vector<Source> sources, const model::effects::DriveModel& base);

}  // namespace identification::gap
