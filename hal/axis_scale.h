/// @file
/// The only place that converts encoder ticks, motor rpm and milliamperes to SI and back.
#pragma once
#include <cstdint>

namespace hal {

/// Data-sheet values of one axis.
struct AxisConstants {
  double gear_ratio = 1.0;               ///< motor turns per joint turn
  std::int32_t ticks_per_motor_rev = 1;  ///< encoder counts, all four edges
  double torque_constant_Nm_per_A = 1.0;
  bool inverted = false;  ///< positive joint motion is negative motor motion
  int pole_pairs = 8;     ///< electrical revolutions per motor turn
};

/// Converts between a motor controller's integers (motor side) and SI at the joint:
///   q = s·ticks·2π/(N·g)    ω = s·rpm·2π/(60·g)    τ = s·I·k_t·g,   s = −1 when inverted.
/// Torque is the motor current's; the friction model covers losses of motor and gear. Sign and rounding
/// follow the official driver for position and velocity (to nearest). Current is also rounded to nearest,
/// where that driver truncates, so that small torques have no bias. Values beyond int32 saturate; a
/// non-finite value becomes 0. Cycle: all conversions.
class AxisScale {
 public:
  /// @throws std::invalid_argument naming the constant that is not finite and positive.
  explicit AxisScale(const AxisConstants& constants);

  double position_rad(std::int32_t motor_ticks) const noexcept { return motor_ticks * rad_per_tick_; }
  double velocity_rad_per_s(std::int32_t motor_rpm) const noexcept { return motor_rpm * rad_per_s_per_rpm_; }
  double torque_Nm(std::int32_t motor_current_mA) const noexcept { return motor_current_mA * Nm_per_mA_; }

  std::int32_t motor_ticks(double position_rad) const noexcept;
  std::int32_t motor_rpm(double velocity_rad_per_s) const noexcept;
  std::int32_t motor_current_mA(double torque_Nm) const noexcept;

  /// Joint-side size of one count, always positive.
  double position_resolution_rad() const noexcept;
  double velocity_resolution_rad_per_s() const noexcept;
  double torque_resolution_Nm() const noexcept;

 private:
  double rad_per_tick_;
  double rad_per_s_per_rpm_;
  double Nm_per_mA_;
};

}  // namespace hal
