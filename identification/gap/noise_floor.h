/// @file
/// The part of a gap that is noise.
#pragma once
#include <vector>

#include "identification/gap/signals.h"

namespace identification::gap {

/// The torque's noise in rows (prediction.h), rms: sensor report minus command response if both are recorded
/// (`reported_Nm`, sample by sample, for each recording that has both), otherwise the difference from sample
/// to sample, taken as white; the effect of encoder steps on the acceleration; and the part of the friction's
/// reversal that is lost if the motion reverses between two samples.
double noise_floor_Nm(const std::vector<Signals>& signals,
                      const std::vector<std::vector<double>>& reported_Nm, const Band& band,
                      const model::effects::DriveModel& base);

}  // namespace identification::gap
