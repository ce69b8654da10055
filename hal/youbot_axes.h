/// @file
/// The youBot's axes: gear ratios, encoders, torque constants and current limits.
/// Source: configuration files of the official youBot driver (youbot-base.cfg, youbot-manipulator.cfg) and
/// its factory parameter dump for the current limits. The thesis rounds the wheel gear to 26. Speed limits: a
/// wheel's is the drives' own maximum for positioning, 4000 rpm of the motor (parameter 4), an arm joint's
/// the user manual's 90°/s.
#pragma once
#include <array>

#include "hal/axis_scale.h"

namespace hal {

struct AxisData {
  AxisConstants constants;
  double current_limit_A;
  double speed_limit_rad_per_s;  ///< of the joint
};

/// Maxon EC 45 flat 50 W. No wheel is inverted: all four positive turn the base counter-clockwise.
inline constexpr AxisData kWheelAxis{{9405.0 / 364.0, 4000, 0.0335, false}, 2.85, 16.2};

inline constexpr double kArmSpeedLimit_rad_per_s = 1.57;
inline constexpr std::array<AxisData, 5> kArmAxes{{
    {{156, 4000, 0.0335, true}, 3.0, kArmSpeedLimit_rad_per_s},
    {{156, 4000, 0.0335, true}, 3.0, kArmSpeedLimit_rad_per_s},
    {{100, 4000, 0.0335, false}, 3.0, kArmSpeedLimit_rad_per_s},
    {{71, 4000, 0.0510, true}, 3.0, kArmSpeedLimit_rad_per_s},
    {{71, 4000, 0.0490, true}, 1.0, kArmSpeedLimit_rad_per_s},
}};

}  // namespace hal
