/// @file
/// Command against delivered torque: the actuator and its sensor, before anything moves.
#pragma once
#include <span>
#include <string>
#include <vector>

#include "identification/gap/gap.h"
#include "identification/gap/signals.h"
#include "model/effects/any_effect.h"

namespace identification::gap {

/// Dead-band, saturation, delay, lag, gain and offset between command and measured torque, beyond those of
/// `base` and behind them. A lag of 10 ms or less, of sensor or current loop, is not an effect; a delay must
/// fit better than any lag. Whether an offset, delay or lag is the actuator's or the torque sensor's, the
/// motion decides (sensor_offset.h, is_of_late_sensor).
/// Without a torque command the delay may be visible in a velocity command (speed_channel.h). Empty if torque
/// was not measured or no command recorded.
struct ActuatorFindings {
  std::vector<FoundEffect> effects;
  /// Measured torque minus the predicted command response, with the gain and the offset that fit best: its
  /// noise, sample by sample, for each recording that has both.
  std::vector<std::vector<double>> left_Nm;
};
ActuatorFindings actuator_channel(std::span<const Signals> all, const model::effects::DriveModel& base,
                                  const Options& options);

/// Whether a delay or lag in `found` is the torque sensor's: the motion shows that the measured torque is
/// recorded late, by `late_s`, which is fitted up to kLongestLag_s.
bool is_of_late_sensor(const FoundEffect& found, double late_s);

}  // namespace identification::gap
