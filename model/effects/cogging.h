/// @file
/// One harmonic of a torque ripple over the joint angle: magnets and slots, gear teeth on the motor's side.
#pragma once
#include <array>
#include <cmath>

#include "model/effects/effect.h"

namespace model::effects {

struct CoggingParameters {
  double amplitude_Nm = 0.01;   ///< A
  double periods_per_rev = 26;  ///< N, of the joint
  double phase_rad = 0;         ///< φ
};

/// A·sin(N·θ + φ); a ripple with several harmonics is several of these.
class Cogging : public WithParameters<Cogging, CoggingParameters> {
 public:
  static constexpr std::string_view kName = "cogging";
  static constexpr std::string_view kShows =
      "torque repeats over position, a whole number of times per turn of motor or joint";
  static constexpr auto kParameters = std::to_array<ParameterInfo<CoggingParameters>>(
      {{"amplitude_Nm", member<&CoggingParameters::amplitude_Nm>, 0, kMaxTorque_Nm},
       {"periods_per_rev", member<&CoggingParameters::periods_per_rev>, 0.5, 1e5},
       {"phase_rad", member<&CoggingParameters::phase_rad>, -6.2831853072, 6.2831853072}});
  static constexpr bool kOnMotor = true;
  using WithParameters::WithParameters;

  double load_Nm(double position_rad) const noexcept {
    return parameters_.amplitude_Nm *
           std::sin(parameters_.periods_per_rev * position_rad + parameters_.phase_rad);
  }
};

}  // namespace model::effects
