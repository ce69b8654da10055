#include "control/base_drive.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>

namespace control {
namespace {

FrictionObserver wheel_observer(int wheel, const BaseDrive::Config& config) {
  if (!config.wheels) return {model::friction::wheel_table(wheel), config.observer};
  const model::JointResistance& resistance = (*config.wheels)[static_cast<std::size_t>(wheel - 1)];
  return {resistance.sliding, config.observer, resistance.position};
}

/// Rejects a wheel model that the motor cannot turn: it is not the measured wheel, and near zero each encoder
/// step would cause a torque pulse.
void require_drivable(const model::JointResistance& wheel, std::size_t number, double limit_Nm) {
  const auto refuse = [&](const std::string& what, double torque_Nm) {
    throw std::invalid_argument("base drive: " + what + " of wheel " + std::to_string(number) +
                                "'s model is " + std::to_string(torque_Nm) +
                                " N·m, not within the torque limit of " + std::to_string(limit_Nm) + " N·m");
  };
  double position_Nm = std::abs(wheel.position.constant_Nm);
  for (const model::PositionTorque::Harmonic& harmonic : wheel.position.harmonics)
    position_Nm += std::abs(harmonic.amplitude_Nm);
  const double rest_Nm = std::max(wheel.sliding.breakaway_Nm(1), wheel.sliding.breakaway_Nm(-1));
  if (!(rest_Nm <= limit_Nm)) refuse("friction at rest", rest_Nm);
  if (!(position_Nm <= limit_Nm)) refuse("the torque by position", position_Nm);
  if (!(wheel.least_torque_Nm >= 0 && wheel.least_torque_Nm <= limit_Nm))
    refuse("the least torque", wheel.least_torque_Nm);
}

}  // namespace

BaseDrive::BaseDrive(const Config& config)
    : config_(config),
      map_(LinkMap::with_geometry(config.geometry)),
      odometry_(map_),
      compensator_(config.compensator),
      observers_{wheel_observer(1, config), wheel_observer(2, config), wheel_observer(3, config),
                 wheel_observer(4, config)},
      friction_factor_(config.friction_factor) {
  if (!(config.wrench_limits.force_N >= 0 && config.wrench_limits.moment_Nm >= 0 &&
        config.torque_limit_Nm >= 0))
    throw std::invalid_argument("base drive: limits must not be negative");
  for (const double factor : config.friction_factor)
    if (!(factor >= 0 && std::isfinite(factor)))
      throw std::invalid_argument("base drive: friction_factor must not be negative");
  if (config.adapt && config.compensate_friction)
    adaptation_.emplace(config.adaptation, map_, config.friction_factor);
  if (!config.wheels) return;
  for (std::size_t i = 0; i < 4; ++i) {
    const model::JointResistance& wheel = (*config.wheels)[i];
    require_drivable(wheel, i + 1, config.torque_limit_Nm);
    if (config.compensate_friction) deadband_modulators_[i] = DeadbandModulator(wheel.least_torque_Nm);
  }
}

void BaseDrive::reset(const WheelVector& wheel_position_rad, const PlanarPose& X_WB) noexcept {
  odometry_.reset(X_WB);
  forget_velocity(wheel_position_rad);
}

void BaseDrive::forget_velocity(const WheelVector& wheel_position_rad) noexcept {
  for (Eigen::Index i = 0; i < 4; ++i) observers_[static_cast<std::size_t>(i)].reset(wheel_position_rad[i]);
  for (DeadbandModulator& modulator : deadband_modulators_) modulator.reset();
  if (adaptation_) adaptation_->forget_motion();
}

BaseDrive::State BaseDrive::sense(const WheelVector& wheel_position_rad,
                                  std::optional<double> elapsed_s) noexcept {
  State state;
  for (Eigen::Index i = 0; i < 4; ++i) {
    const auto wheel = static_cast<std::size_t>(i);
    estimates_[wheel] = observers_[wheel].step(wheel_position_rad[i], elapsed_s);
    state.wheel_velocity_rad_per_s[i] = estimates_[wheel].velocity_rad_per_s;
  }
  state.X_WB = odometry_.step(wheel_position_rad);
  state.twist_B = map_.twist(state.wheel_velocity_rad_per_s);
  if (adaptation_) learn_friction(state, elapsed_s.value_or(config_.observer.filter.period_s));
  state.friction_factor = friction_factor_;
  return state;
}

void BaseDrive::learn_friction(const State& state, double elapsed_s) noexcept {
  // Without compensation, the drives may be off or turn the wheels by themselves: their torque is not known.
  if (compensated_)
    adaptation_->step(torque_Nm_, command_Nm_, estimates_, state.twist_B, elapsed_s);
  else
    adaptation_->forget_motion();
  compensated_ = false;
  friction_factor_ = adaptation_->factors();
}

BaseDrive::Torques BaseDrive::drive(const PlanarVector& wrench_B, bool compensate) noexcept {
  Torques torques;
  const Limited<PlanarVector> wrench = limited_wrench(wrench_B, config_.wrench_limits);
  torques.wrench_B = wrench.value;
  WheelVector torque_Nm = map_.wheel_torque(wrench.value);
  compensated_ = compensate;
  command_Nm_ = torque_Nm;
  if (compensate)
    for (Eigen::Index i = 0; i < 4; ++i) {
      const auto wheel = static_cast<std::size_t>(i);
      torque_Nm[i] +=
          compensator_.torque_Nm(torque_Nm[i], estimates_[wheel], observers_[wheel], friction_factor_[wheel]);
    }
  const Limited<WheelVector> torque = limited_torque(torque_Nm, config_.torque_limit_Nm);
  for (Eigen::Index i = 0; i < 4; ++i)
    torques.torque_Nm[i] = deadband_modulators_[static_cast<std::size_t>(i)].step(torque.value[i]);
  torque_Nm_ = torques.torque_Nm;
  torques.limited = wrench.limited || torque.limited;
  return torques;
}

}  // namespace control
