#include "sim/drive.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace sim {

namespace {

model::effects::Mechanics mechanics(const DriveParameters& parameters,
                                    const model::effects::EffectChain& effects) {
  return effects.arranged(
      {.inertia_kg_m2 = parameters.load_inertia_kg_m2 +
                        parameters.motor.rotor_inertia_kg_m2 * parameters.gear_ratio * parameters.gear_ratio,
       .stiffness_Nm_per_rad = parameters.presliding.stiffness,
       .damping_Nm_s_per_rad = parameters.presliding.damping});
}

}  // namespace

Drive::Drive(const DriveParameters& parameters, std::optional<model::friction::SlidingTable> friction,
             std::uint64_t noise_seed)
    : parameters_(parameters),
      effects_(parameters.effects),
      motor_(parameters.motor),
      parts_(mechanics(parameters, effects_), std::move(friction), effects_),
      sensors_(parameters.sensors, noise_seed),
      Nm_per_A_(parameters.motor.torque_constant_Nm_per_A * parameters.gear_ratio) {}

void Drive::control(const hal::JointCommand& command, bool powered, double interval_s) noexcept {
  powered_ = powered;
  if (!powered_ || command.mode == hal::CommandMode::kTorque) velocity_integral_Nm_ = 0.0;
  if (!powered_) {
    motor_.power_off();
    return;
  }
  target_current_A_ = effects_.deliver(target_torque_Nm(command, interval_s), interval_s) / Nm_per_A_;
}

double Drive::target_torque_Nm(const hal::JointCommand& command, double interval_s) noexcept {
  if (command.mode == hal::CommandMode::kTorque) return command.target;

  double velocity_rad_per_s = command.target;
  if (command.mode == hal::CommandMode::kPosition) {
    const double limit = parameters_.position_speed_limit_rad_per_s;
    velocity_rad_per_s = std::clamp(
        parameters_.position_gain_per_s * (command.target - sensors_.position_rad()), -limit, limit);
  }
  const double error = velocity_rad_per_s - sensors_.velocity_rad_per_s();
  const double limit_Nm = Nm_per_A_ * parameters_.motor.current_limit_A;
  velocity_integral_Nm_ =
      std::clamp(velocity_integral_Nm_ + parameters_.velocity_integral_gain_Nm_per_rad * error * interval_s,
                 -limit_Nm, limit_Nm);
  return parameters_.velocity_gain_Nm_s_per_rad * error + velocity_integral_Nm_;
}

void Drive::step(double load_Nm, double step_s) noexcept {
  motor_torque_Nm_ = powered_
                         ? parameters_.gear_ratio *
                               motor_.step(target_current_A_,
                                           parts_.motor_velocity_rad_per_s() * parameters_.gear_ratio, step_s)
                         : 0.0;
  parts_.step(motor_torque_Nm_, load_Nm, step_s);
}

void Drive::sense(double interval_s) noexcept {
  const double position_rad = parts_.motor_position_rad();
  sensors_.update(position_rad + effects_.encoder_error(position_rad).value_rad,
                  effects_.report_Nm(motor_torque_Nm_), interval_s);
}

hal::JointSample Drive::measured() const noexcept {
  return {sensors_.position_rad(), sensors_.velocity_rad_per_s(), sensors_.torque_Nm(),
          hal::JointFault::kNone};
}

}  // namespace sim
