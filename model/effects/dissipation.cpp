#include "model/effects/dissipation.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "model/effects/effect_chain.h"
#include "model/friction/dissipation.h"

namespace model::effects {

std::vector<AnyEffect> with_least_friction(std::span<const AnyEffect> effects) {
  std::vector<AnyEffect> result(effects.begin(), effects.end());
  for (AnyEffect& any : result)
    if (const auto* friction = std::get_if<PositionFriction>(&any))
      any = PositionFriction({.amplitude_Nm = friction->parameters().amplitude_Nm,
                              .phase_rad = -0.5 * std::numbers::pi});  // at the chain's position 0
  return result;
}

std::optional<double> driving_velocity_rad_per_s(const DriveModel& model, double top_speed_rad_per_s) {
  const EffectChain effects(with_least_friction(model.effects));
  const auto friction_Nm = [&effects](double velocity_rad_per_s) {
    const double direction = std::copysign(1.0, velocity_rad_per_s);
    const auto after = [&](double running_s) {
      return effects.signed_level_Nm(
          {.speed_rad_per_s = std::abs(velocity_rad_per_s), .direction = direction, .running_s = running_s});
    };
    return direction * std::min(after(0), after(std::numeric_limits<double>::infinity()));
  };
  return model::friction::driving_velocity_rad_per_s(friction_Nm, top_speed_rad_per_s);
}

}  // namespace model::effects
