#include "model/effects/dissipation.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "model/effects/effect_chain.h"
#include "model/friction/dissipation.h"

namespace model::effects {

std::optional<double> driving_velocity_rad_per_s(const DriveModel& model, double top_speed_rad_per_s) {
  const EffectChain effects(model.effects);
  const auto friction_Nm = [&effects](double velocity_rad_per_s) {
    const double direction = std::copysign(1.0, velocity_rad_per_s);
    const auto after = [&](double running_s) {
      return effects.signed_level_Nm(std::abs(velocity_rad_per_s), direction, running_s, 0);
    };
    return direction * std::min(after(0), after(std::numeric_limits<double>::infinity()));
  };
  return model::friction::driving_velocity_rad_per_s(friction_Nm, top_speed_rad_per_s);
}

}  // namespace model::effects
