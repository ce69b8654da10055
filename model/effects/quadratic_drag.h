/// @file
/// Friction in proportion to the square of speed: stirred grease, air; negative where grease thins.
#pragma once
#include <array>

#include "model/effects/effect.h"

namespace model::effects {

struct QuadraticDragParameters {
  double coefficient_Nm_s2_per_rad2 = 0.0005;
};

class QuadraticDrag : public WithParameters<QuadraticDrag, QuadraticDragParameters> {
 public:
  static constexpr std::string_view kName = "quadratic_drag";
  static constexpr std::string_view kShows =
      "friction curves away from the straight line more the faster the joint is";
  static constexpr auto kParameters = std::to_array<ParameterInfo<QuadraticDragParameters>>(
      {{"coefficient_Nm_s2_per_rad2", member<&QuadraticDragParameters::coefficient_Nm_s2_per_rad2>, -1e4,
        1e4}});
  static constexpr auto kAmplitudes = std::to_array<std::string_view>({"coefficient_Nm_s2_per_rad2"});
  using WithParameters::WithParameters;

  double level_Nm(const Sliding& sliding) const noexcept {
    return parameters_.coefficient_Nm_s2_per_rad2 * sliding.speed_rad_per_s * sliding.speed_rad_per_s;
  }
};

}  // namespace model::effects
