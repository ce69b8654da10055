/// @file
/// Friction in proportion to the torque that the transmission carries.
#pragma once
#include <array>

#include "model/effects/effect.h"

namespace model::effects {

struct LoadFrictionParameters {
  double share = 0.1;  ///< of the load torque
};

/// [W. Duclusaud et al., ICRA 2025, arXiv 2410.08650; Bittencourt et al., IROS 2010]
class LoadFriction : public WithParameters<LoadFriction, LoadFrictionParameters> {
 public:
  static constexpr std::string_view kName = "load_friction";
  static constexpr std::string_view kShows =
      "more friction where the joint carries load, whichever way it turns";
  static constexpr auto kParameters = std::to_array<ParameterInfo<LoadFrictionParameters>>(
      {{"share", member<&LoadFrictionParameters::share>, 0, 2}});
  using WithParameters::WithParameters;

  double level_Nm(const Sliding& sliding) const noexcept { return parameters_.share * sliding.load_Nm; }
};

}  // namespace model::effects
