#include "control/base_controller.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>

namespace control {
namespace {

FrictionObserver wheel_observer(int wheel, const BaseController::Config& config) {
  if (!config.wheels) return {friction::wheel_table(wheel), config.observer};
  const JointResistance& resistance = (*config.wheels)[static_cast<std::size_t>(wheel - 1)];
  return {resistance.sliding, config.observer, resistance.position};
}

/// A wheel that its motor cannot turn is not the wheel that was measured: near zero each step of the encoder
/// would become a blow.
void require_drivable(const JointResistance& wheel, std::size_t number, double limit_Nm) {
  const auto refuse = [&](const std::string& what, double torque_Nm) {
    throw std::invalid_argument("base controller: " + what + " of wheel " + std::to_string(number) +
                                "'s model is " + std::to_string(torque_Nm) +
                                " N·m, not within the torque limit of " + std::to_string(limit_Nm) + " N·m");
  };
  double position_Nm = std::abs(wheel.position.constant_Nm);
  for (const PositionTorque::Harmonic& harmonic : wheel.position.harmonics)
    position_Nm += std::abs(harmonic.amplitude_Nm);
  const double rest_Nm = std::max(wheel.sliding.breakaway_Nm(1), wheel.sliding.breakaway_Nm(-1));
  if (!(rest_Nm <= limit_Nm)) refuse("friction at rest", rest_Nm);
  if (!(position_Nm <= limit_Nm)) refuse("the torque by position", position_Nm);
  if (!(wheel.least_torque_Nm >= 0 && wheel.least_torque_Nm <= limit_Nm))
    refuse("the least torque", wheel.least_torque_Nm);
}

}  // namespace

BaseController::BaseController(const Config& config)
    : config_(config),
      map_(LinkMap::with_geometry(config.geometry)),
      odometry_(map_),
      compensator_(config.compensator),
      observers_{wheel_observer(1, config), wheel_observer(2, config), wheel_observer(3, config),
                 wheel_observer(4, config)} {
  const auto usable = [](const PlanarVector& gain) { return gain.allFinite() && (gain.array() >= 0).all(); };
  if (!usable(config.stiffness) || !usable(config.damping) || !usable(config.feedforward_inertia))
    throw std::invalid_argument("base controller: gains must be finite and not negative");
  if (!(config.wrench_limits.force_N >= 0 && config.wrench_limits.moment_Nm >= 0 &&
        config.torque_limit_Nm >= 0))
    throw std::invalid_argument("base controller: limits must not be negative");
  if (!config.wheels) return;
  for (std::size_t i = 0; i < 4; ++i) {
    const JointResistance& wheel = (*config.wheels)[i];
    require_drivable(wheel, i + 1, config.torque_limit_Nm);
    if (config.compensate_friction) small_torques_[i] = SmallTorques(wheel.least_torque_Nm);
  }
}

void BaseController::reset(const WheelVector& wheel_position_rad, const PlanarPose& X_WB) noexcept {
  odometry_.reset(X_WB);
  forget_velocity(wheel_position_rad);
}

void BaseController::forget_velocity(const WheelVector& wheel_position_rad) noexcept {
  for (Eigen::Index i = 0; i < 4; ++i) observers_[static_cast<std::size_t>(i)].reset(wheel_position_rad[i]);
  for (SmallTorques& torques : small_torques_) torques.reset();
}

BaseController::Output BaseController::step(const WheelVector& wheel_position_rad,
                                            const BaseReference& reference) noexcept {
  Output output = observe(wheel_position_rad);
  const PlanarPose& X_WB = output.X_WB;
  const PlanarVector error_W(reference.X_WB.x_m - X_WB.x_m, reference.X_WB.y_m - X_WB.y_m,
                             reference.X_WB.yaw_rad - X_WB.yaw_rad);
  // Gains are axes of the base frame, so errors are turned there first.
  drive(config_.stiffness.cwiseProduct(rotated(error_W, -X_WB.yaw_rad)) +
            config_.damping.cwiseProduct(rotated(reference.twist_W, -X_WB.yaw_rad) - output.twist_B) +
            config_.feedforward_inertia.cwiseProduct(rotated(reference.acceleration_W, -X_WB.yaw_rad)),
        config_.compensate_friction, output);
  return output;
}

BaseController::Output BaseController::brake(const WheelVector& wheel_position_rad) noexcept {
  Output output = observe(wheel_position_rad);
  drive(-config_.damping.cwiseProduct(output.twist_B), false, output);
  return output;
}

BaseController::Output BaseController::observe(const WheelVector& wheel_position_rad) noexcept {
  Output output;
  for (Eigen::Index i = 0; i < 4; ++i) {
    const auto wheel = static_cast<std::size_t>(i);
    estimates_[wheel] = observers_[wheel].step(wheel_position_rad[i]);
    output.wheel_velocity_rad_per_s[i] = estimates_[wheel].velocity_rad_per_s;
  }
  output.X_WB = odometry_.step(wheel_position_rad);
  output.twist_B = map_.twist(output.wheel_velocity_rad_per_s);
  return output;
}

void BaseController::drive(const PlanarVector& wrench_B, bool compensate, Output& output) noexcept {
  const Limited<PlanarVector> wrench = limited_wrench(wrench_B, config_.wrench_limits);
  output.wrench_B = wrench.value;
  WheelVector torque_Nm = map_.wheel_torque(wrench.value);
  if (compensate)
    for (Eigen::Index i = 0; i < 4; ++i) {
      const auto wheel = static_cast<std::size_t>(i);
      torque_Nm[i] += compensator_.torque_Nm(torque_Nm[i], estimates_[wheel], observers_[wheel]);
    }
  const Limited<WheelVector> torque = limited_torque(torque_Nm, config_.torque_limit_Nm);
  for (Eigen::Index i = 0; i < 4; ++i)
    output.torque_Nm[i] = small_torques_[static_cast<std::size_t>(i)].step(torque.value[i]);
  output.limited = wrench.limited || torque.limited;
}

}  // namespace control
