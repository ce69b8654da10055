/// @file
/// Effects as columns of a regression.
///
///     const AnyEffect column = basis_of(make_effect("viscous"), "coefficient_Nm_s_per_rad");
///     A(i, k) = sliding_torque_Nm(EffectChain({&column, 1}), velocity[i]);
#pragma once
#include <span>
#include <string_view>

#include "model/effects/any_effect.h"
#include "model/effects/effect_chain.h"

namespace model::effects {

/// Torque against positive motion of a joint that slides steadily, from a cold start, at position 0. At ±0
/// its limit from that side.
double sliding_torque_Nm(const EffectChain& effects, double velocity_rad_per_s) noexcept;

/// The parameters in which the torque of `effect` is linear; may be empty.
std::span<const std::string_view> amplitudes_of(const AnyEffect& effect);
/// The effect with one amplitude 1, the others 0 and its shape unchanged: its torque is the column of that
/// amplitude. @throws std::invalid_argument if the effect has no such amplitude.
AnyEffect basis_of(const AnyEffect& effect, std::string_view amplitude);

}  // namespace model::effects
