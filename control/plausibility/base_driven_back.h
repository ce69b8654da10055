/// @file
/// Detects a base that moves against the torques of its wheels from rest on.
#pragma once
#include "control/link_map.h"

namespace control {

/// Energy balance: from rest on, the motors cannot take more energy out of the motion than they have put in,
/// except what a push, a slope or the arm adds. If all four encoders count backwards, or all motors turn
/// backwards, the base speeds up against its torques instead. Braking takes out what was put in before, so no
/// mass is needed; friction only dissipates; and what is taken out while the base slows down does not count:
/// a push that ends. A push from outside that exceeds friction by up to 16 N is allowed for, and so is a
/// share of what the arm's motors have put in, until the next rest. Compensation of friction in the direction
/// of the shown motion puts energy in, also while a person pushes the base back.
///
/// Once the motors have put in more than a bound, net of what they took out, the base is known to move with
/// its torques, and the check is silent until restart(): encoders or motors of all four wheels do not turn
/// round in operation. The check begins at rest. One thread. Cycle: all but construction; nothing allocates
/// or throws.
class BaseDrivenBack {
 public:
  /// @param torque_limit_Nm of a wheel's motor.
  explicit BaseDrivenBack(double torque_limit_Nm) noexcept : limit_Nm_(torque_limit_Nm) {}

  void restart() noexcept;
  /// Call with each fresh sample, `elapsed_s` after the last one. `torque_Nm`: commanded now; `arm_J`: recent
  /// energy from the arm's motors. True: the base moves against its torques.
  bool update(const WheelVector& position_rad, const WheelVector& torque_Nm, double arm_J,
              double elapsed_s) noexcept;

 private:
  bool judge() noexcept;

  double limit_Nm_;
  bool known_ = false;
  bool begun_ = false;  // has been at rest since the start
  bool moves_with_torque_ = false;
  WheelVector position_rad_ = WheelVector::Zero();
  WheelVector torque_Nm_ = WheelVector::Zero();  // commanded with the last sample
  // The current block.
  WheelVector way_rad_ = WheelVector::Zero();
  double work_J_ = 0.0;  // of the motors
  double duration_s_ = 0.0;
  double speed_rad_per_s_ = 0.0;  // of the last block: of a wheel in forward motion
  double put_in_J_ = 0.0;         // by the motors, minus what they took out while the base did not slow down
  double turned_rad_ = 0.0;       // since the last rest
  double from_arm_J_ = 0.0;       // since then: greatest energy that the arm may have given
};

}  // namespace control
