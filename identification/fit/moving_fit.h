/// @file
/// Inertia and sliding friction together, from a moving joint.
#pragma once
#include <string>
#include <vector>

#include "identification/fit/statistics.h"
#include "identification/recording.h"

namespace identification::fit {

struct MovingFitOptions {
  double cutoff_rad_per_s = 125;  ///< of the filter that derives velocity and acceleration from position
  double slowest_rad_per_s = 0;   ///< slower samples are left out; 0: a fiftieth of the fastest
  bool torque_offset = true;      ///< fitted if both directions are present
};

struct MovingFit {
  /// inertia_kg_m2, then those of the effects coulomb, viscous and torque_offset
  std::vector<Estimate> parameters;
  double relative_error_percent = 0;  ///< of the filtered torque, samples used
  std::size_t used = 0;               ///< samples
  double condition = 0;
  double torque_lag_s = 0;  ///< taken, by which the torque is recorded late; 0 unless the data show it
  std::vector<std::string> verdicts;
};

/// Least squares of τ = J·a + Fc·sgn(v) + σ2·v + τ0 with torque_measured_Nm (torque_command_Nm without it)
/// and position_rad. Position and torque pass the same control::StateVariableFilter, twice, so that both have
/// the same lag. Excluded are the start of the recording, slow samples and those so close to a reversal that
/// the filter mixes both signs of friction. Intervals allow for residuals that are correlated over time. A
/// parameter that the motion does not excite gets a reason instead of a number: without acceleration no
/// inertia, at one speed no viscous friction, in one direction no offset. Friction gets no number either if
/// its interval includes zero. A torque that is recorded up to 10 ms late or 2 ms early, which biases all of
/// them, is fitted too. If the lag lies beyond, it is taken as the end of that range, with a verdict; if it
/// does not differ from none, as none: in both cases the intervals allow for the lag that remains unknown.
/// @throws std::invalid_argument if columns or an even sample rate are missing, or nothing moves.
MovingFit fit_moving(const Recording& recording, const MovingFitOptions& options = {});

}  // namespace identification::fit
