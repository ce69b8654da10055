/// @file
/// How much of a gap is noise.
#pragma once
#include <vector>

#include "identification/gap/signals.h"

namespace identification::gap {

/// The torque's noise in rows (prediction.h), rms: what the sensor reported beyond the command where both are
/// recorded (`reported_Nm`, sample by sample, of each recording that has both), else what differs from sample
/// to sample, taken as white; what the encoder's steps make of the acceleration; and what of the friction's
/// turn is lost where the motion reverses between two samples.
double noise_floor_Nm(const std::vector<Signals>& signals,
                      const std::vector<std::vector<double>>& reported_Nm, const Band& band,
                      const model::effects::DriveModel& base);

}  // namespace identification::gap
