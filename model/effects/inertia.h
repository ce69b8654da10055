/// @file
/// Deviation of the moving inertia from the model's.
#pragma once
#include <array>

#include "model/effects/effect.h"

namespace model::effects {

struct InertiaParameters {
  double difference_kg_m2 = 0.001;  ///< added to the model's
};

class Inertia : public WithParameters<Inertia, InertiaParameters> {
 public:
  static constexpr std::string_view kName = "inertia";
  static constexpr std::string_view kShows = "torque in proportion to acceleration is left over";
  static constexpr auto kParameters = std::to_array<ParameterInfo<InertiaParameters>>(
      {{"difference_kg_m2", member<&InertiaParameters::difference_kg_m2>, -1e5, 1e5}});
  using WithParameters::WithParameters;

  void arrange(Mechanics& mechanics) const noexcept {
    mechanics.inertia_kg_m2 += parameters_.difference_kg_m2;
  }
};

}  // namespace model::effects
