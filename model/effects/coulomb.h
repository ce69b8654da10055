/// @file
/// Friction that does not depend on speed.
#pragma once
#include <array>

#include "model/effects/effect.h"

namespace model::effects {

struct CoulombParameters {
  double torque_Nm = 0.04;
};

class Coulomb : public WithParameters<Coulomb, CoulombParameters> {
 public:
  static constexpr std::string_view kName = "coulomb";
  static constexpr std::string_view kShows =
      "a constant torque against the motion, at every speed, that changes sign with direction";
  static constexpr auto kParameters = std::to_array<ParameterInfo<CoulombParameters>>(
      {{"torque_Nm", member<&CoulombParameters::torque_Nm>, 0, kMostTorque_Nm}});
  static constexpr auto kAmplitudes = std::to_array<std::string_view>({"torque_Nm"});
  using WithParameters::WithParameters;

  double level_Nm(const Sliding& /*sliding*/) const noexcept { return parameters_.torque_Nm; }
};

}  // namespace model::effects
