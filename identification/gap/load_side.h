/// @file
/// What a load behind a gap or a spring asks of the motor whose motion was measured.
#pragma once
#include <span>
#include <vector>

#include "identification/gap/signals.h"
#include "model/effects/effect.h"
#include "model/effects/effect_chain.h"

namespace identification::gap {

/// Torque on the motor, mean over the period before each sample, of a load that has all of the drive's
/// inertia and friction and follows the measured motor through the gap or the spring of `mechanics`; of a
/// real load only its share counts. The load is simulated: it coasts through a gap and rings on a spring,
/// which the motion of the motor alone does not show, and `pull_Nm`, what works against positive motion of
/// the real load at each sample, moves it there. A hit on a flank is without rebound.
std::vector<double> load_side_Nm(const model::effects::Mechanics& mechanics,
                                 const model::effects::EffectChain& chain, const Signals& signals,
                                 std::span<const double> pull_Nm);

}  // namespace identification::gap
