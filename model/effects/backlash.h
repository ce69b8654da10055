/// @file
/// Free travel between motor and load.
#pragma once
#include <array>

#include "model/effects/effect.h"

namespace model::effects {

struct BacklashParameters {
  double gap_rad = 0.01;    ///< from one flank to the other
  double load_share = 0.3;  ///< of inertia and friction, behind the gap
};

class Backlash : public WithParameters<Backlash, BacklashParameters> {
 public:
  static constexpr std::string_view kName = "backlash";
  static constexpr std::string_view kShows =
      "after each reversal the motor turns with little torque until it meets the other flank";
  static constexpr auto kParameters = std::to_array<ParameterInfo<BacklashParameters>>(
      {{"gap_rad", member<&BacklashParameters::gap_rad>, 1e-6, 3},
       {"load_share", member<&BacklashParameters::load_share>, 0.01, 0.99}});
  using WithParameters::WithParameters;

  void arrange(Mechanics& mechanics) const noexcept {
    mechanics.backlash_rad = parameters_.gap_rad;
    mechanics.load_share = parameters_.load_share;
  }
};

}  // namespace model::effects
