/// @file
/// The friction contact is elastic before breakaway.
#pragma once
#include <array>

#include "model/effects/effect.h"

namespace model::effects {

struct PreslidingParameters {
  double stiffness_Nm_per_rad = 250;  ///< σ0
  double damping_Nm_s_per_rad = 0;    ///< σ1, while it sticks
  double exponent = 0;                ///< α
};

/// σ0 and σ1 of the bristle, and how it yields: Dahl's α is 0 for a bristle that stays straight until
/// breakaway, 1 for one that bends exponentially, as in LuGre. [dahl_curve.h]
class Presliding : public WithParameters<Presliding, PreslidingParameters> {
 public:
  static constexpr std::string_view kName = "presliding";
  static constexpr std::string_view kShows =
      "the joint moves a little, and back, under torques that do not break it away; friction turns over a "
      "distance after a reversal";
  static constexpr auto kParameters = std::to_array<ParameterInfo<PreslidingParameters>>(
      {{"stiffness_Nm_per_rad", member<&PreslidingParameters::stiffness_Nm_per_rad>, 1e-6, 1e8},
       {"damping_Nm_s_per_rad", member<&PreslidingParameters::damping_Nm_s_per_rad>, 0, 1e5},
       {"exponent", member<&PreslidingParameters::exponent>, 0, 3}});
  using WithParameters::WithParameters;

  void arrange(Mechanics& mechanics) const noexcept {
    mechanics.stiffness_Nm_per_rad = parameters_.stiffness_Nm_per_rad;
    mechanics.damping_Nm_s_per_rad = parameters_.damping_Nm_s_per_rad;
    mechanics.bend_exponent = parameters_.exponent;
  }
};

}  // namespace model::effects
