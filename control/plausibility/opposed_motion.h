/// @file
/// Detects a joint that moves against its motor's torque without slowing down.
#pragma once
#include "control/plausibility/sample_time.h"

namespace control {

/// Energy balance: a motor that opposes the motion takes energy out of it, so the joint slows down unless
/// something else drives it. The robot's other motors may do so: when the end effector touches a wall, they
/// can push a joint back for any length of time. A share of the energy that they put in is therefore
/// allowed for, up to a bound. Beyond the bound, either the encoder counts backwards, or a person pushes the
/// joint with force. The weight's torque is assumed to be known within a fifth; friction only dissipates and
/// needs no model. Samples of uncertain time are left out. Of the recently commanded torques, also during a
/// gap in the samples, the one that explains most of the motion counts, because the speed follows some
/// milliseconds later.
///
/// Hall sensors do not know the sense of rotation: an encoder that counts backwards since power-up agrees
/// with them. But once a joint has moved with its torque by more than a bound, net of motion against it, its
/// encoder counts correctly as long as both agree in the same sense as then.
/// One thread. Cycle: all but construction; nothing allocates or throws.
class OpposedMotion {
 public:
  /// @param torque_limit_Nm of the joint's motor: the scale of the tolerated energy error.
  explicit OpposedMotion(double torque_limit_Nm) noexcept : limit_Nm_(torque_limit_Nm) {}

  void restart() noexcept;
  /// Call with each fresh sample. `torque_Nm`: commanded; `weight_Nm`: torque that holds the links against
  /// gravity; `hall_sense`: HallAgreement::sense().
  void update(double position_rad, double torque_Nm, double weight_Nm, int hall_sense,
              const SampleTime& time) noexcept;
  /// Recent energy from this joint's motor; not negative.
  double put_in_J() const noexcept;
  /// Whether the joint moves against its torque, given the energy from the other motors.
  bool opposed(double put_in_by_others_J) const noexcept;

 private:
  struct Range {
    double least_Nm = 0.0;
    double most_Nm = 0.0;
    void add(double torque_Nm) noexcept;
  };
  void trust(int hall_sense) noexcept;
  bool vouched_for() const noexcept;

  double limit_Nm_;
  bool known_ = false;
  double known_s_ = 0.0;  // time for which it has been known
  double position_rad_ = 0.0;
  double passed_s_ = 0.0;  // since the last sample of known time
  Range asked_;
  Range asked_before_;
  double asked_s_ = 0.0;             // duration that asked_ covers
  double velocity_rad_per_s_ = 0.0;  // smoothed
  double earlier_rad_per_s_ = 0.0;   // smoothed more: the velocity shortly before
  double taken_out_J_ = 0.0;
  double put_in_J_ = 0.0;
  int hall_sense_ = 0;
  int seen_sense_ = 0;   // Hall sense to which seen_J_ belongs
  double seen_J_ = 0.0;  // energy of motion with the torque, minus motion against it
};

}  // namespace control
