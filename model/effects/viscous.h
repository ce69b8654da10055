/// @file
/// Friction in proportion to speed.
#pragma once
#include <array>

#include "model/effects/effect.h"

namespace model::effects {

struct ViscousParameters {
  double coefficient_Nm_s_per_rad = 0.0125;
};

class Viscous : public WithParameters<Viscous, ViscousParameters> {
 public:
  static constexpr std::string_view kName = "viscous";
  static constexpr std::string_view kShows = "a torque against the motion that grows in proportion to speed";
  static constexpr auto kParameters = std::to_array<ParameterInfo<ViscousParameters>>(
      {{"coefficient_Nm_s_per_rad", member<&ViscousParameters::coefficient_Nm_s_per_rad>, 0, 1e4}});
  static constexpr auto kAmplitudes = std::to_array<std::string_view>({"coefficient_Nm_s_per_rad"});
  using WithParameters::WithParameters;

  double level_Nm(const Sliding& sliding) const noexcept {
    return parameters_.coefficient_Nm_s_per_rad * sliding.speed_rad_per_s;
  }
};

}  // namespace model::effects
