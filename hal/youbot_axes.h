/// @file
/// The youBot's axes: gear ratios, encoders, torque constants and current limits. Source: configuration files
/// of the official youBot driver (youbot-base.cfg, youbot-manipulator.cfg), and its factory parameter dump
/// for current limits and motor poles. The thesis rounds the wheel gear to 26. Speed limits: for a wheel the
/// drives' own maximum for positioning, 4000 rpm of the motor (parameter 4); for an arm joint 90°/s from the
/// user manual. Rated torques of the arm: effort limits of the official robot description
/// (youbot_description). Ranges of the arm: soft limits of youbot-manipulator.cfg, in the driver's angles;
/// they lie inside the description's end stops by 0.01 rad at the end where homing finishes and by 0.06 to
/// 0.21 rad at the other end, where robots have been measured to reach less than the description says.
#pragma once
#include <array>
#include <limits>
#include <string>
#include <utility>

#include "hal/axis_scale.h"
#include "hal/joint.h"
#include "hal/robot.h"

namespace hal {

struct AxisData {
  AxisConstants constants;
  double current_limit_A;
  double speed_limit_rad_per_s;                                      ///< of the joint
  double rated_torque_Nm = std::numeric_limits<double>::infinity();  ///< see JointInfo
  JointRange range{};
};

/// Maxon EC 45 flat 50 W. No wheel is inverted: all four positive turn the base counter-clockwise.
inline constexpr AxisData kWheelAxis{{9405.0 / 364.0, 4000, 0.0335, false}, 2.85, 16.2};

inline constexpr double kArmSpeedLimit_rad_per_s = 1.57;
inline constexpr std::array<AxisData, 5> kArmAxes{{
    {{156, 4000, 0.0335, true}, 3.0, kArmSpeedLimit_rad_per_s, 9.5, {0.01007, 5.84014}},
    {{156, 4000, 0.0335, true}, 3.0, kArmSpeedLimit_rad_per_s, 9.5, {0.01007, 2.61799}},
    {{100, 4000, 0.0335, false}, 3.0, kArmSpeedLimit_rad_per_s, 6.0, {-5.02655, -0.01571}},
    {{71, 4000, 0.0510, true}, 3.0, kArmSpeedLimit_rad_per_s, 2.0, {0.02212, 3.42920}},
    {{71, 4000, 0.0490, true, 4}, 1.0, kArmSpeedLimit_rad_per_s, 1.0, {0.11062, 5.64159}},
}};

/// Setup: JointInfo of a joint on that axis.
inline JointInfo joint_info(std::string name, const AxisData& axis) {
  return {.name = std::move(name),
          .torque_limit_Nm =
              axis.current_limit_A * axis.constants.torque_constant_Nm_per_A * axis.constants.gear_ratio,
          .speed_limit_rad_per_s = axis.speed_limit_rad_per_s,
          .rated_torque_Nm = axis.rated_torque_Nm,
          .range = axis.range};
}

}  // namespace hal
