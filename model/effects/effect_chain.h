/// @file
/// The effects of one drive in operation, each at its place in the chain.
#pragma once
#include <span>
#include <vector>

#include "model/effects/any_effect.h"
#include "model/effects/delay_line.h"

namespace model::effects {

/// One joint's effects and their state. One thread. Setup: the constructor. Cycle: the others, which neither
/// allocate nor lock.
class EffectChain {
 public:
  EffectChain() = default;
  explicit EffectChain(std::span<const AnyEffect> effects);

  bool empty() const noexcept { return effects_.empty(); }
  /// The torque the actuator delivers for a command, once per controller period of `interval_s`.
  double deliver(double command_Nm, double interval_s) noexcept;
  /// Sliding friction at `speed_rad_per_s` >= 0 in `direction`, positive against the motion; not below zero.
  /// `load_Nm`: the other torque in the transmission.
  double level_Nm(double speed_rad_per_s, double direction, double running_s, double load_Nm) const noexcept;
  /// The same as the plain sum of the effects, negative where they would drive.
  double signed_level_Nm(double speed_rad_per_s, double direction, double running_s,
                         double load_Nm) const noexcept;
  /// Position-dependent torque against positive motion of the load; with one mass, of the joint.
  double load_Nm(double position_rad) const noexcept;
  /// The same for the motor, if it is a separate mass.
  double motor_load_Nm(double position_rad) const noexcept;
  /// Output of the torque sensor for a torque.
  double report_Nm(double torque_Nm) const noexcept;
  /// Masses, springs and gaps after all effects. @throws std::invalid_argument if no inertia is left.
  Mechanics arranged(Mechanics mechanics) const;

 private:
  std::vector<AnyEffect> effects_;
  std::vector<DelayLine> lines_;  // one per effect that acts on the actuator
  double coulomb_Nm_ = 0;
};

}  // namespace model::effects
