/// @file
/// A spring between motor and load.
#pragma once
#include <array>

#include "model/effects/effect.h"

namespace model::effects {

struct ElasticityParameters {
  double stiffness_Nm_per_rad = 100;
  double damping_Nm_s_per_rad = 0;
  double load_share = 0.3;  ///< of inertia and friction, behind the spring
};

class Elasticity : public WithParameters<Elasticity, ElasticityParameters> {
 public:
  static constexpr std::string_view kName = "elasticity";
  static constexpr std::string_view kShows =
      "less inertia than the model's above one frequency and more just below it";
  static constexpr auto kParameters = std::to_array<ParameterInfo<ElasticityParameters>>(
      {{"stiffness_Nm_per_rad", member<&ElasticityParameters::stiffness_Nm_per_rad>, 1e-6, 1e8},
       {"damping_Nm_s_per_rad", member<&ElasticityParameters::damping_Nm_s_per_rad>, 0, 1e5},
       {"load_share", member<&ElasticityParameters::load_share>, 0.01, 0.99}});
  using WithParameters::WithParameters;

  void arrange(Mechanics& mechanics) const noexcept {
    mechanics.shaft_Nm_per_rad = parameters_.stiffness_Nm_per_rad;
    mechanics.shaft_Nm_s_per_rad = parameters_.damping_Nm_s_per_rad;
    mechanics.load_share = parameters_.load_share;
  }
};

}  // namespace model::effects
