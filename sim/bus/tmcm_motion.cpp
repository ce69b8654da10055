#include "sim/bus/tmcm_motion.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace sim::bus {
namespace {

using drivers::tmcl::ControllerMode;

constexpr double kPositionGain_per_s = 10.0;  // like sim::Drive's own position loop
constexpr double kFullPwm = 1799.0;           // KU Leuven driver

}  // namespace

double TmcmMotion::position_profile_rpm(std::int32_t error_ticks,
                                        const TmcmParameters& parameters) const noexcept {
  const double error_rev = static_cast<double>(error_ticks) / axis_.ticks_per_motor_rev;
  double speed_rpm = std::min<double>(60 * kPositionGain_per_s * std::abs(error_rev), parameters[4]);
  // The ramp must be able to stop at the target: v² = 2·a·s.
  if (parameters[146] != 0)
    speed_rpm = std::min(speed_rpm, std::sqrt(2.0 * parameters[11] * 60 * std::abs(error_rev)));
  return std::copysign(speed_rpm, error_rev);
}

hal::JointCommand TmcmMotion::update(const drivers::tmcl::DriveOutput& command, const MotorState& motor,
                                     const TmcmParameters& parameters,
                                     std::chrono::nanoseconds period) noexcept {
  const double limit_mA = parameters[6];
  target_rpm_ = target_mA_ = 0.0;
  switch (command.mode) {
    case ControllerMode::kCurrent:
      restart(motor);
      target_mA_ = std::clamp<double>(command.value, -limit_mA, limit_mA);
      return hal::JointCommand::torque_Nm(units_.torque_Nm(target_mA_));
    case ControllerMode::kPwm: {
      // The current settles within a period: I = (V − k_e·ω)/R.
      restart(motor);
      const double voltage_V = axis_.supply_V * std::clamp(command.value / kFullPwm, -1.0, 1.0);
      const double back_emf_V =
          axis_.torque_constant_Nm_per_A * motor.velocity_rpm * 2 * std::numbers::pi / 60;
      target_mA_ =
          std::clamp(1000 * (voltage_V - back_emf_V) / axis_.winding_resistance_ohm, -limit_mA, limit_mA);
      return hal::JointCommand::torque_Nm(units_.torque_Nm(target_mA_));
    }
    case ControllerMode::kPosition:
      target_rpm_ = position_profile_rpm(ticks_between(motor.position_ticks, command.value), parameters);
      break;
    case ControllerMode::kVelocity: target_rpm_ = command.value; break;
    default: break;  // stop: zero velocity
  }
  const double change_rpm = parameters[11] * std::chrono::duration<double>(period).count();
  ramp_rpm_ = parameters[146] != 0 ? std::clamp(target_rpm_, ramp_rpm_ - change_rpm, ramp_rpm_ + change_rpm)
                                   : target_rpm_;
  return hal::JointCommand::velocity_rad_per_s(units_.velocity_rad_per_s(ramp_rpm_));
}

}  // namespace sim::bus
