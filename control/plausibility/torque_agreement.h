/// @file
/// Compares the torque that a motor controller measures by its current with the torque it was asked for.
#pragma once
#include <array>
#include <cstddef>

#include "hal/joint.h"

namespace control {

/// Only in torque mode: a current controller settles within a millisecond or two. Commands of the last dozen
/// cycles bound what may be measured; what is beyond them, a share of the command and a bias adds up until it
/// decides. A joint that is stopped at once, by an end stop or a wall, changes the motor's back-EMF at once,
/// and the current is off until the controller has found the other voltage: its time integral by
///   (k_t·g)²/R · T · Δω,   with the controller's time T.
/// So much more is allowed while the speed has changed by Δω lately. Drives that report the current's
/// magnitude only are kept apart from a wrong sign: a negative command with a positive reading is wrong only
/// once negative readings have been seen. A reading that stays the same to the last bit while the command
/// changes is frozen, however small both are: a live one has noise. One thread. Cycle: update() and restart()
/// neither allocate nor throw.
class TorqueAgreement {
 public:
  /// @param bias_Nm by which the reading may be off at any command.
  /// @param blow_Nm_s2_per_rad (k_t·g)²/R · T.
  TorqueAgreement(double torque_limit_Nm, double bias_Nm, double blow_Nm_s2_per_rad) noexcept
      : limit_Nm_(torque_limit_Nm), bias_Nm_(bias_Nm), blow_Nm_s2_per_rad_(blow_Nm_s2_per_rad) {}

  void restart() noexcept;
  /// Once a cycle, before update(): what has just been sent.
  void command(const hal::JointCommand& command) noexcept;
  /// With each fresh sample, `elapsed_s` after the last one. True: they disagree.
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
  double changed_rad_per_s_ = 0.0;   // lately
  // Since the reading changed last.
  double reading_Nm_ = 0.0;
  double low_Nm_ = 0.0;
  double high_Nm_ = 0.0;
  int same_ = 0;
};

}  // namespace control
