/// @file
/// A weight off the axis.
#pragma once
#include <array>
#include <cmath>

#include "model/effects/effect.h"

namespace model::effects {

struct ImbalanceParameters {
  double torque_Nm = 0.01;       ///< T, with the arm level
  double rest_position_rad = 0;  ///< θ0
};

/// T·sin(θ − θ0): pulls back to θ0, where it hangs.
class Imbalance : public WithParameters<Imbalance, ImbalanceParameters> {
 public:
  static constexpr std::string_view kName = "imbalance";
  static constexpr std::string_view kShows = "torque repeats once per turn of the joint, whatever the speed";
  static constexpr auto kParameters = std::to_array<ParameterInfo<ImbalanceParameters>>(
      {{"torque_Nm", member<&ImbalanceParameters::torque_Nm>, 0, kMaxTorque_Nm},
       {"rest_position_rad", member<&ImbalanceParameters::rest_position_rad>, -6.2831853072, 6.2831853072}});
  using WithParameters::WithParameters;

  double load_Nm(double position_rad) const noexcept {
    return parameters_.torque_Nm * std::sin(position_rad - parameters_.rest_position_rad);
  }
};

}  // namespace model::effects
