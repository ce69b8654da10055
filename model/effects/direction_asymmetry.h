/// @file
/// Friction that differs by direction.
#pragma once
#include <array>

#include "model/effects/effect.h"

namespace model::effects {

struct DirectionAsymmetryParameters {
  double coulomb_Nm = 0;
  double viscous_Nm_s_per_rad = 0;
};

/// Half the difference between positive and negative motion.
class DirectionAsymmetry : public WithParameters<DirectionAsymmetry, DirectionAsymmetryParameters> {
 public:
  static constexpr std::string_view kName = "direction_asymmetry";
  static constexpr std::string_view kShows =
      "more torque one way than the other; while the joint slides, its constant part is the same as a torque "
      "offset";
  static constexpr auto kParameters = std::to_array<ParameterInfo<DirectionAsymmetryParameters>>(
      {{"coulomb_Nm", member<&DirectionAsymmetryParameters::coulomb_Nm>, -kMostTorque_Nm, kMostTorque_Nm},
       {"viscous_Nm_s_per_rad", member<&DirectionAsymmetryParameters::viscous_Nm_s_per_rad>, -1e4, 1e4}});
  static constexpr auto kAmplitudes = std::to_array<std::string_view>({"coulomb_Nm", "viscous_Nm_s_per_rad"});
  using WithParameters::WithParameters;

  double level_Nm(const Sliding& sliding) const noexcept {
    return sliding.direction *
           (parameters_.coulomb_Nm + parameters_.viscous_Nm_s_per_rad * sliding.speed_rad_per_s);
  }
};

}  // namespace model::effects
