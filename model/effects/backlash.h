/// @file
/// Free travel between motor and load.
#pragma once
#include <array>

#include "model/effects/effect.h"

namespace model::effects {

struct BacklashParameters {
  double gap_rad = 0.01;             ///< from one flank to the other
  double load_share = 0.3;           ///< of inertia, behind the gap
  double friction_ratio = 1;         ///< share of friction behind the gap, over that of inertia
  double impact_loss_s_per_rad = 2;  ///< α: flanks that collide at a low speed v separate at (1 − α·v)·v
  double flank_Hz = 150;             ///< resonance of both masses on a flank; not fitted
};

class Backlash : public WithParameters<Backlash, BacklashParameters> {
 public:
  static constexpr std::string_view kName = "backlash";
  static constexpr std::string_view kShows =
      "after each reversal the motor turns with little torque until it meets the other flank";
  static constexpr auto kParameters = std::to_array<ParameterInfo<BacklashParameters>>(
      {{"gap_rad", member<&BacklashParameters::gap_rad>, 1e-6, 3},
       {"load_share", member<&BacklashParameters::load_share>, 0.01, 0.99},
       {"friction_ratio", member<&BacklashParameters::friction_ratio>, 0, 20},
       {"impact_loss_s_per_rad", member<&BacklashParameters::impact_loss_s_per_rad>, 0, 1e4},
       {"flank_Hz", member<&BacklashParameters::flank_Hz>, 20, 2000}});
  using WithParameters::WithParameters;

  void arrange(Mechanics& mechanics) const noexcept {
    mechanics.backlash_rad = parameters_.gap_rad;
    mechanics.load_share = parameters_.load_share;
    mechanics.friction_ratio = parameters_.friction_ratio;
    mechanics.flank_loss_s_per_rad = parameters_.impact_loss_s_per_rad;
    mechanics.flank_Hz = parameters_.flank_Hz;
  }
};

}  // namespace model::effects
