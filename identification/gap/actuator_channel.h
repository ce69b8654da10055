/// @file
/// Command against delivered torque: what the actuator and its sensor do before anything moves.
#pragma once
#include <span>
#include <string>
#include <vector>

#include "identification/gap/gap.h"
#include "identification/gap/signals.h"
#include "model/effects/any_effect.h"

namespace identification::gap {

/// Dead-band, delay and offset between command and measured torque. A sensor or current loop that only lags
/// is no effect; a delay must do better than any lag. Without a torque command the delay may show in a
/// velocity command (speed_channel.h). Empty where torque was not measured or no command recorded.
struct ActuatorFindings {
  std::vector<FoundEffect> effects;
  /// What the sensor reported beyond the command through all that: its noise, sample by sample, of each
  /// recording that has both.
  std::vector<std::vector<double>> left_Nm;
};
ActuatorFindings actuator_channel(std::span<const Signals> all, const model::effects::DriveModel& base,
                                  const Options& options);

}  // namespace identification::gap
