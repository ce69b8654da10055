/// @file
/// A drive as a model file describes it: an inertia, sensors and a list of effects.
#pragma once
#include <optional>
#include <string>
#include <vector>

#include "model/effects/any_effect.h"
#include "model/servo_law.h"

namespace model::effects {

/// Joint side. The effects are in the order of the file; actuator and sensor effects act in this order.
struct DriveModel {
  std::string name{};
  double inertia_kg_m2 = 0.0112;
  std::optional<double> encoder_ticks_per_rev{};
  std::optional<double> torque_noise_Nm{};  ///< 1 sigma of the reported torque
  std::vector<AnyEffect> effects{};
  std::optional<model::ServoLaw> servo{};  ///< how a set-point becomes the torque command

  /// The first effect of a type, or null.
  template <Effect E>
  const E* find() const noexcept {
    for (const AnyEffect& effect : effects)
      if (const E* found = std::get_if<E>(&effect)) return found;
    return nullptr;
  }
};

}  // namespace model::effects
