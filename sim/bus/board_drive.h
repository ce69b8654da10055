/// @file
/// Interface between a motor controller board and its mechanics, with the board's units.
#pragma once
#include <cmath>
#include <cstdint>
#include <numbers>

#include "hal/joint.h"

namespace sim::bus {

/// Motor, gear and encoder of one axis, from its data sheets.
struct BoardAxis {
  double gear_ratio = 1.0;  ///< motor turns per joint turn
  std::int32_t ticks_per_motor_rev = 4000;
  double torque_constant_Nm_per_A = 0.0335;
  bool inverted = false;  ///< positive joint motion is negative motor motion
  double current_limit_A = 3.0;
  std::int32_t motor_poles = 16;
  double winding_resistance_ohm = 0.978;
  double supply_V = 24.0;

  constexpr std::int32_t ticks_per_electrical_rev() const noexcept {
    return 2 * ticks_per_motor_rev / motor_poles;
  }
};

/// Converts between the board's motor-side integers and SI at the joint. Independent of hal/axis_scale.h, so
/// that an error in one of them is detected.
class MotorUnits {
 public:
  explicit MotorUnits(const BoardAxis& axis) noexcept
      : sign_(axis.inverted ? -1.0 : 1.0),
        rad_per_tick_(2 * std::numbers::pi / (axis.ticks_per_motor_rev * axis.gear_ratio)),
        rad_per_s_per_rpm_(2 * std::numbers::pi / (60 * axis.gear_ratio)),
        Nm_per_mA_(axis.torque_constant_Nm_per_A * axis.gear_ratio / 1000) {}

  std::int64_t ticks(double position_rad) const noexcept {
    return std::llround(sign_ * position_rad / rad_per_tick_);
  }
  double rpm(double velocity_rad_per_s) const noexcept {
    return sign_ * velocity_rad_per_s / rad_per_s_per_rpm_;
  }
  double current_mA(double torque_Nm) const noexcept { return sign_ * torque_Nm / Nm_per_mA_; }
  double velocity_rad_per_s(double motor_rpm) const noexcept {
    return sign_ * motor_rpm * rad_per_s_per_rpm_;
  }
  double torque_Nm(double motor_mA) const noexcept { return sign_ * motor_mA * Nm_per_mA_; }
  double position_rad(double ticks) const noexcept { return sign_ * ticks * rad_per_tick_; }

 private:
  double sign_;
  double rad_per_tick_;
  double rad_per_s_per_rpm_;
  double Nm_per_mA_;
};

/// One joint as seen by its board. A command holds until the next one; the owner of the mechanics advances
/// them. Cycle: both functions.
class BoardDrive {
 public:
  BoardDrive() = default;
  BoardDrive(const BoardDrive&) = delete;
  BoardDrive& operator=(const BoardDrive&) = delete;
  virtual ~BoardDrive() = default;

  /// Unpowered: the bridge is open and the joint coasts.
  virtual void command(const hal::JointCommand& command, bool powered) noexcept = 0;
  virtual hal::JointSample measured() const noexcept = 0;
};

}  // namespace sim::bus
