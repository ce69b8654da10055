/// @file
/// A recorded torque that is too large by one factor looks like an inertia: both fit the data equally well.
#pragma once
#include <optional>

#include "identification/gap/gap.h"
#include "model/effects/drive_model.h"

namespace identification::gap {

/// The factor by which the inertia and all other known amplitudes of the result differ from the given model:
/// the scale of the torque (its constant, the gear ratio, the sensor's gain) may be wrong instead. Empty if
/// the factors differ, if the common factor is near 1, or if the result has an inertia and fewer than two
/// other amplitudes with narrow intervals.
std::optional<double> torque_scale(const model::effects::DriveModel& given, const Result& result);

/// The name of this rival in FoundEffect::equivalent.
inline constexpr const char* kTorqueScale = "torque_scale";
/// If there is such a factor: makes kTorqueScale a rival of the inertia, and notes how to find out.
void weigh_torque_scale(const model::effects::DriveModel& given, Result& result);

}  // namespace identification::gap
