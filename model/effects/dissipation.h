/// @file
/// Checks that the friction of a drive model brakes.
#pragma once
#include <optional>
#include <vector>

#include "model/effects/drive_model.h"
#include "model/effects/effect_chain.h"

namespace model::effects {

/// Default speed limit of a youBot's wheel.
inline constexpr double kUsualTopSpeed_rad_per_s = 12.0;

/// The velocity nearest to rest, up to the top speed in either direction, at which the friction effects
/// together would drive the joint, cold or warm. A simulated drive has no friction there, and a compensation
/// with such a model is wrong at all speeds beyond. See model::friction::driving_velocity_rad_per_s().
std::optional<double> driving_velocity_rad_per_s(const DriveModel& model, double top_speed_rad_per_s);

/// The least that the sliding friction of a model can be at a velocity: over position, load, time since the
/// reversal, and temperature. A gear's loss is zero at some load. One thread; level_Nm() does not allocate.
class LeastFriction {
 public:
  explicit LeastFriction(const DriveModel& model);
  /// Against the motion in `direction` (+1 or -1) at `speed_rad_per_s` >= 0; negative where the effects
  /// drive.
  double level_Nm(double speed_rad_per_s, double direction) const noexcept;

 private:
  EffectChain named_;
  std::vector<Empirical> unnamed_;
  double largest_load_Nm_;
};

}  // namespace model::effects
