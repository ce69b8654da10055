/// @file
/// Compares the torque that a motor controller measures by its current with the commanded torque.
#pragma once
#include <array>
#include <cstddef>

#include "hal/joint.h"

namespace control {

/// Only in torque mode, where a current controller settles within a millisecond or two. The commands of the
/// last dozen cycles bound the expected reading; the excess beyond these bounds, a share of the command and a
/// bias is integrated until it reaches the alarm threshold. If an end stop or a wall stops a joint suddenly,
/// the motor's back-EMF changes suddenly, and the current is off until the controller has adapted its
/// voltage. The time integral of the torque error is then
///   (k_t·g)²/R · T · Δω,   with the controller's time constant T.
/// The threshold rises by this amount after a recent change of speed by Δω. Drives that report only the
/// current's magnitude are distinguished from a wrong sign: a positive reading for a negative command is
/// wrong only after negative readings have been seen. A reading that stays bitwise equal while the command
/// changes is frozen, however small both are, because a working one has noise. One thread. Cycle: update()
/// and restart() neither allocate nor throw.
class TorqueAgreement {
 public:
  /// @param bias_Nm tolerated error of the reading at any command.
  /// @param blow_Nm_s2_per_rad (k_t·g)²/R · T.
  TorqueAgreement(double torque_limit_Nm, double bias_Nm, double blow_Nm_s2_per_rad) noexcept
      : limit_Nm_(torque_limit_Nm), bias_Nm_(bias_Nm), blow_Nm_s2_per_rad_(blow_Nm_s2_per_rad) {}

  void restart() noexcept;
  /// Call once per cycle, before update(), with the command just sent.
  void command(const hal::JointCommand& command) noexcept;
  /// Call with each fresh sample, `elapsed_s` after the last one. True: they disagree.
  bool update(double position_rad, double torque_Nm, double elapsed_s) noexcept;

 private:
  void watch_speed(double position_rad, double elapsed_s) noexcept;
  bool frozen(double torque_Nm) noexcept;

  static constexpr std::size_t kMemory = 12;

  double limit_Nm_;
  double bias_Nm_;
  double blow_Nm_s2_per_rad_;
  std::array<double, kMemory> commands_Nm_{};
  std::size_t count_ = 0;
  double excess_Nm_s_ = 0.0;
  bool shows_sign_ = false;
  bool position_known_ = false;
  double position_rad_ = 0.0;
  double velocity_rad_per_s_ = 0.0;  // smoothed
  double earlier_rad_per_s_ = 0.0;   // smoothed more
  double changed_rad_per_s_ = 0.0;   // recent change of speed
  // Since the last change of the reading.
  double reading_Nm_ = 0.0;
  double low_Nm_ = 0.0;
  double high_Nm_ = 0.0;
  int same_ = 0;
};

}  // namespace control
