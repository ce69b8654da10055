/// @file
/// Axis data of the emulated robot. Gears, torque constants and directions: configuration of the official
/// driver; current limits: factory parameter dump of the KU Leuven driver. Separate from hal/youbot_axes.h,
/// because a plant and the software that drives it must not share a source; a test compares them.
#pragma once
#include <array>
#include <numbers>

#include "sim/bus/board_drive.h"
#include "sim/motor.h"

namespace sim::bus {

struct ArmJointData {
  BoardAxis axis;
  /// End stops, in the official driver's angles: 0 is the stop that homing touches. Ranges: robot
  /// description.
  double lower_stop_rad = 0.0;
  double upper_stop_rad = 0.0;
  /// Assumptions: a half-stretched arm, and friction a fifth of the homing threshold. Joint 1 has as much as
  /// stops it within a degree when it is released from its end stop, which homing allows.
  double load_inertia_kg_m2 = 0.1;
  double coulomb_Nm = 0.5;
  double viscous_Nm_s_per_rad = 0.2;
  double rotor_inertia_kg_m2 = MotorParameters{}.rotor_inertia_kg_m2;  ///< before the gear
};

inline constexpr BoardAxis kWheelBoardAxis{.gear_ratio = 9405.0 / 364.0, .current_limit_A = 2.85};

namespace detail {
constexpr double degrees(double value) { return value * std::numbers::pi / 180; }
}  // namespace detail

inline constexpr std::array<ArmJointData, 5> kArmJointData{{
    {{.gear_ratio = 156, .inverted = true}, 0, detail::degrees(338), 0.25, 1.15, 0.5},
    {{.gear_ratio = 156, .inverted = true}, 0, detail::degrees(155), 0.35, 1.0, 0.5},
    {{.gear_ratio = 100}, detail::degrees(-297), 0, 0.15, 0.6, 0.3},
    {{.gear_ratio = 71, .torque_constant_Nm_per_A = 0.051, .inverted = true},
     0,
     detail::degrees(205),
     0.03,
     0.4,
     0.2},
    {{.gear_ratio = 71,
      .torque_constant_Nm_per_A = 0.049,
      .inverted = true,
      .current_limit_A = 1.0,
      .motor_poles = 8},
     0,
     detail::degrees(335),
     0.001,
     0.3,
     0.15},
}};

}  // namespace sim::bus
