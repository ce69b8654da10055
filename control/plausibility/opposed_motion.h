/// @file
/// Notices a joint that moves, no slower and slower, against the torque that drives it.
#pragma once
#include "control/plausibility/sample_time.h"

namespace control {

/// Energy put in against energy seen: a motor that opposes the motion takes energy out of it, so the joint
/// slows down unless something else drives it. The robot's other motors do: through a wall that the tip
/// touches they push a joint back for as long as they like. So a share of what they put in meanwhile is
/// allowed for, up to a bound. Beyond that the encoder counts backwards, or a person pushes the joint through
/// with force. The weight's torque counts as known to a fifth; friction only takes energy and needs no model.
/// Samples whose time is not known are left out. Of the torques asked lately, and over a hold-up, the one
/// that explains most counts: the speed follows it some milliseconds later.
///
/// Hall sensors know no sense of turning: an encoder that counts backwards from power-up agrees with them,
/// too. But while a joint has moved with its torque by more than a bound, net of motion against it, its
/// encoder counts the right way as long as they agree in the sense in which they did then.
/// One thread. Cycle: all but construction; nothing allocates or throws.
class OpposedMotion {
 public:
  /// @param torque_limit_Nm of the joint's motor: the scale of what it may take out in error.
  explicit OpposedMotion(double torque_limit_Nm) noexcept : limit_Nm_(torque_limit_Nm) {}

  void restart() noexcept;
  /// With each fresh sample. `torque_Nm`: asked of the motor; `weight_Nm`: what holds the links there;
  /// `hall_sense`: HallAgreement::sense().
  void update(double position_rad, double torque_Nm, double weight_Nm, int hall_sense,
              const SampleTime& time) noexcept;
  /// By this joint's motor, lately; not negative.
  double put_in_J() const noexcept;
  /// Whether it moves against its torque, where the others have put in so much.
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
  double known_s_ = 0.0;  // for so long
  double position_rad_ = 0.0;
  double passed_s_ = 0.0;  // since a sample whose time is known
  Range asked_;
  Range asked_before_;
  double asked_s_ = 0.0;             // for how long it has been asked_
  double velocity_rad_per_s_ = 0.0;  // smoothed
  double earlier_rad_per_s_ = 0.0;   // smoothed more: what it was shortly before
  double taken_out_J_ = 0.0;
  double put_in_J_ = 0.0;
  int hall_sense_ = 0;
  int seen_sense_ = 0;   // in which
  double seen_J_ = 0.0;  // it has moved with its torque, less against it
};

}  // namespace control
