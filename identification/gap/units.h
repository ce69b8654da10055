/// @file
/// Checks units and signs by the consistency of the columns and by the implied inertia and friction.
#pragma once
#include <vector>

#include "identification/gap/gap.h"

namespace identification::gap {

/// Compares `sample_rate_Hz` with the times, and the position's derivative with the velocity; then fits
/// inertia and friction to torque and motion. Rejects a factor between them and those of `base` that a unit
/// explains better than a wrong model does, and a torque that gains energy from friction.
/// @throws std::invalid_argument naming recording, column, likely cause and remedy.
void check_units(const Source& source, const model::effects::DriveModel& base,
                 std::vector<Diagnosis>& diagnoses);

}  // namespace identification::gap
