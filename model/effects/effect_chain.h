/// @file
/// The effects of one drive in operation, each at its place in the chain.
#pragma once
#include <optional>
#include <span>
#include <vector>

#include "model/effects/any_effect.h"
#include "model/effects/delay_line.h"
#include "model/friction/law.h"

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
  /// Sliding friction, positive against the motion; not below zero.
  double level_Nm(const Slide& slide) const noexcept;
  /// The same as the plain sum of the effects, negative where they would drive.
  double signed_level_Nm(const Slide& slide) const noexcept;
  /// The same without the laws with memory: what the friction contact carries.
  double contact_level_Nm(const Slide& slide) const noexcept;
  /// The same under a torque of the motor, in the direction of positive motion, instead of an acceleration.
  double contact_level_under_Nm(const Slide& slide, double motor_Nm) const noexcept;

  /// Friction laws with memory. Each part of the joint that has friction keeps its own states, one per law.
  std::size_t law_count() const noexcept { return laws_.size(); }
  /// Their friction against positive motion at the end of a step, as friction::Law::step().
  double laws_Nm(std::span<friction::State> states, const friction::Contact& contact,
                 double step_s) const noexcept;
  /// Friction of these laws where the other effects reduce friction by more than the contact carries:
  /// `contact_level_Nm` is that in the direction of `laws_Nm`. By that direction, not by that of the
  /// velocity: a loaded joint that rings while it sticks gains no energy.
  double reduced_laws_Nm(double laws_Nm, double speed_rad_per_s, double contact_level_Nm) const noexcept;
  /// The same as laws_Nm() after a long time at this velocity.
  double steady_laws_Nm(double velocity_rad_per_s) const noexcept;
  /// Longest stable step of the friction laws, with and without memory, on a part of the joint with this
  /// inertia and share of the friction; infinite without laws.
  double longest_step_s(double inertia_kg_m2, double friction_share) const noexcept;

  /// Position-dependent torque against positive motion of the load; with one mass, of the joint.
  double load_Nm(double position_rad) const noexcept;
  /// The same for the motor, if it is a separate mass.
  double motor_load_Nm(double position_rad) const noexcept;
  /// Output of the torque sensor for a torque.
  double report_Nm(double torque_Nm) const noexcept;
  /// Torque of the motor at a position, over that which its current means.
  double motor_gain(double position_rad) const noexcept;
  /// What the encoder adds to the motor's position; all zero without an effect on it.
  EncoderError encoder_error(double position_rad) const noexcept;
  bool acts_on_encoder() const noexcept { return acts_on_encoder_; }
  /// The motor's motion of which the encoder reports `measured`.
  struct Motion {
    double position_rad = 0;
    double velocity_rad_per_s = 0;
    double acceleration_rad_per_s2 = 0;
  };
  Motion motion_behind(const Motion& measured) const noexcept;
  /// Masses, springs and gaps after all effects. @throws std::invalid_argument if no inertia is left.
  Mechanics arranged(Mechanics mechanics) const;

 private:
  template <class Use>
  double sliding_Nm(const Slide& slide, const Use& use) const noexcept;
  double gear_loss_Nm(const Slide& slide, double sliding_Nm) const noexcept;

  std::vector<AnyEffect> effects_;
  std::vector<FrictionLaw> laws_;         // those with memory
  std::vector<ActuatorMemory> memories_;  // one per effect that acts on the actuator
  std::vector<LoadFriction> gears_;
  double coulomb_Nm_ = 0;
  bool acts_on_encoder_ = false;
};

}  // namespace model::effects
