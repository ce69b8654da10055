/// @file
/// The effects of one drive at work, each at its place.
#pragma once
#include <span>
#include <vector>

#include "model/effects/any_effect.h"
#include "model/effects/delay_line.h"

namespace model::effects {

/// One joint's effects and what they remember. One thread. Setup: the constructor. Cycle: the others, which
/// neither allocate nor lock.
class EffectChain {
 public:
  EffectChain() = default;
  explicit EffectChain(std::span<const AnyEffect> effects);

  bool empty() const noexcept { return effects_.empty(); }
  /// The torque the actuator delivers for a command, once per controller period of `interval_s`.
  double deliver(double command_Nm, double interval_s) noexcept;
  /// Sliding friction at `speed_rad_per_s` >= 0 in `direction`, what takes torque from the motion; not below
  /// zero. `load_Nm`: what the transmission carries besides.
  double level_Nm(double speed_rad_per_s, double direction, double running_s, double load_Nm) const noexcept;
  /// The same as the effects add up, below zero where they would drive.
  double signed_level_Nm(double speed_rad_per_s, double direction, double running_s,
                         double load_Nm) const noexcept;
  /// Torque against positive motion of the load by where it is; with one mass, of the joint.
  double load_Nm(double position_rad) const noexcept;
  /// The same of the motor, where that is another mass.
  double motor_load_Nm(double position_rad) const noexcept;
  /// What the torque sensor makes of a torque.
  double report_Nm(double torque_Nm) const noexcept;
  /// What effects make of masses, springs and gaps. @throws std::invalid_argument when no inertia is left.
  Mechanics arranged(Mechanics mechanics) const;

 private:
  std::vector<AnyEffect> effects_;
  std::vector<DelayLine> lines_;  // one per effect that acts on the actuator
  double coulomb_Nm_ = 0;
};

}  // namespace model::effects
