/// @file
/// Notices a joint that moves, no slower and slower, against the torque that drives it.
#pragma once
#include "control/plausibility/sample_time.h"

namespace control {

/// Energy put in against energy seen: a motor that opposes the motion takes energy out of it, so the joint
/// slows down unless something else drives it. Where the motor's own work says the opposite of the encoder
/// for long, the encoder counts backwards, or a person pushes the joint through with force. The weight's
/// torque counts as known to a fifth; friction only takes energy and needs no model. Samples whose time is
/// not known are left out; of the torques asked over a hold-up the one that explains most counts. One thread.
/// Cycle: update() and restart() neither allocate nor throw.
class OpposedMotion {
 public:
  /// @param torque_limit_Nm of the joint's motor: the scale of what it may take out in error.
  explicit OpposedMotion(double torque_limit_Nm) noexcept : limit_Nm_(torque_limit_Nm) {}

  void restart() noexcept { known_ = false; }
  /// With each fresh sample. `torque_Nm`: asked of the motor; `weight_Nm`: what holds the links there. True:
  /// it moves against its torque.
  bool update(double position_rad, double torque_Nm, double weight_Nm, const SampleTime& time) noexcept;

 private:
  double limit_Nm_;
  bool known_ = false;
  double position_rad_ = 0.0;
  // Since a sample whose time is known.
  double passed_s_ = 0.0;
  double least_Nm_ = 0.0;
  double most_Nm_ = 0.0;
  double velocity_rad_per_s_ = 0.0;  // smoothed
  double earlier_rad_per_s_ = 0.0;   // smoothed more: what it was shortly before
  double taken_out_J_ = 0.0;
};

}  // namespace control
