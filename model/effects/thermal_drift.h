/// @file
/// Friction that changes as the drive warms up.
#pragma once
#include <array>
#include <cmath>

#include "model/effects/effect.h"

namespace model::effects {

struct ThermalDriftParameters {
  double coulomb_change_Nm = -0.01;        ///< once warm
  double viscous_change_Nm_s_per_rad = 0;  ///< once warm
  double time_constant_s = 60;             ///< T
};

/// (1 − exp(−t/T)) times the change, from a cold start.
class ThermalDrift : public WithParameters<ThermalDrift, ThermalDriftParameters> {
 public:
  static constexpr std::string_view kName = "thermal_drift";
  static constexpr std::string_view kShows =
      "friction at the same speed differs between the beginning and the end of a recording";
  static constexpr auto kParameters = std::to_array<ParameterInfo<ThermalDriftParameters>>(
      {{"coulomb_change_Nm", member<&ThermalDriftParameters::coulomb_change_Nm>, -kMostTorque_Nm,
        kMostTorque_Nm},
       {"viscous_change_Nm_s_per_rad", member<&ThermalDriftParameters::viscous_change_Nm_s_per_rad>, -1e4,
        1e4},
       {"time_constant_s", member<&ThermalDriftParameters::time_constant_s>, 1, 1e5}});
  using WithParameters::WithParameters;

  double level_Nm(const Sliding& sliding) const noexcept {
    return shape(sliding.running_s, parameters_.time_constant_s) *
           (parameters_.coulomb_change_Nm +
            parameters_.viscous_change_Nm_s_per_rad * sliding.speed_rad_per_s);
  }
  /// 0 cold, 1 warm.
  static double shape(double running_s, double time_constant_s) noexcept {
    return -std::expm1(-running_s / time_constant_s);
  }
};

}  // namespace model::effects
