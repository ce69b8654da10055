/// @file
/// Friction that is higher at rest and falls as the joint begins to slide.
#pragma once
#include <array>

#include "model/effects/effect.h"
#include "model/friction/stribeck_curve.h"

namespace model::effects {

struct StribeckParameters {
  double static_torque_Nm = 0.08;   ///< Fs, all of it: Coulomb friction included
  double velocity_rad_per_s = 0.3;  ///< vs
  double exponent = 2;              ///< δ
};

/// (Fs − Fc)·exp(−(|v|/vs)^δ) above the Coulomb torque Fc                       [friction.md 3; thesis 2.3]
class Stribeck : public WithParameters<Stribeck, StribeckParameters> {
 public:
  static constexpr std::string_view kName = "stribeck";
  static constexpr std::string_view kShows =
      "break-away above the sliding torque; friction falls with speed near standstill";
  static constexpr auto kParameters = std::to_array<ParameterInfo<StribeckParameters>>(
      {{"static_torque_Nm", member<&StribeckParameters::static_torque_Nm>, 0, kMostTorque_Nm},
       {"velocity_rad_per_s", member<&StribeckParameters::velocity_rad_per_s>, 1e-4, kMostSpeed_rad_per_s},
       {"exponent", member<&StribeckParameters::exponent>, 0.3, 4}});
  static constexpr auto kAmplitudes = std::to_array<std::string_view>({"static_torque_Nm"});
  using WithParameters::WithParameters;

  double level_Nm(const Sliding& sliding) const noexcept {
    return (parameters_.static_torque_Nm - sliding.coulomb_Nm) *
           shape(sliding.speed_rad_per_s, parameters_.velocity_rad_per_s, parameters_.exponent);
  }
  /// 1 at rest, towards 0 at speed.
  static double shape(double speed_rad_per_s, double velocity_rad_per_s, double exponent) noexcept {
    return model::friction::stribeck_share(speed_rad_per_s / velocity_rad_per_s, exponent);
  }
};

}  // namespace model::effects
