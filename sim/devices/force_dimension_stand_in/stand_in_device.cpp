#include "sim/devices/force_dimension_stand_in/stand_in_device.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace sim::devices {
namespace {

constexpr double kStep_s = 50e-6;
constexpr double kTransfer_s = 250e-6;
constexpr double kGravity_m_per_s2 = 9.81;
constexpr double kMass_kg = 0.25;
constexpr double kViscous_Ns_per_m = 1.0;
constexpr double kCoulomb_N = 0.15;
constexpr double kBrake_Ns_per_m = 30.0;
constexpr double kMotorPole_rad_per_s = 2.0 * 3.14159265358979 * 300.0;
constexpr double kMotorLimit_N = 12.0;
constexpr double kWorkspace_m = 0.08;
constexpr double kWatchdogTick_s = 125e-6;
constexpr double kHandMass_kg = 0.5;
constexpr double kPositionStep_m = 1e-5;
constexpr double kAngleStep_rad = 0.09 * 3.14159265358979 / 180.0;
constexpr Axes kRest_m{0.03, 0.0, -0.05};       // position of the handle without calibration
constexpr Axes kUncalibrated_m{0.0, 0.0, 0.0};  // reported then, whatever the position
constexpr Axes kRegulation_N{0.0, 0.0, 2.0};    // holding force at the end of the calibration

enum Cause { kNoCause = 0, kVelocity = 2, kWatchdog = 3, kSoftware = 4, kUnplugged = 5 };

double norm(const Axes& vector) { return std::hypot(vector[0], vector[1], vector[2]); }

Axes quantised(const Axes& values, double step) {
  Axes result{};
  for (std::size_t i = 0; i < 3; ++i) result[i] = std::round(values[i] / step) * step;
  return result;
}

}  // namespace

void StandInDevice::reset(const ForceDimensionScript& fresh) {
  *this = {};
  script = fresh;
  state.effector_mass_kg = fresh.effector_mass_kg;
  if (!script.calibrated) state.position_m = kRest_m;
  time_guard_us_ = script.time_guard_us;
}

void StandInDevice::open() {
  state.open = true;
  if (!script.calibrated) {
    change_to(ForceDimensionMode::kReset);
  } else if (state.mode == ForceDimensionMode::kReset) {
    change_to(ForceDimensionMode::kBrake);
  }
  state.effector_mass_kg = script.effector_mass_kg;
  time_guard_us_ = script.time_guard_us;
  transfer();
  transfer();
}

void StandInDevice::change_to(ForceDimensionMode mode) {
  if (mode == state.mode) return;
  previous_mode_ = std::exchange(state.mode, mode);
  changed_s_ = state.time_s;
}

ForceDimensionMode StandInDevice::reported_mode() const {
  return state.time_s - changed_s_ < script.status_delay_s ? previous_mode_ : state.mode;
}

void StandInDevice::close() {
  state.open = state.opened_by_drd = false;
  if (!script.close_keeps_mode) brake(kSoftware);
}

void StandInDevice::calibrate() {
  ++state.calibrations;
  // The path is not public; its long duration is what matters.
  state.time_s += script.calibration_s;
  state.position_m = {};
  state.velocity_m_per_s = {};
  script.calibrated = true;
  state.regulation = true;
  state.command_N = target_N_ = kRegulation_N;
  change_to(ForceDimensionMode::kForce);
  state.force_off_cause = kNoCause;
  fed_s_ = state.time_s;
  transfer();
  transfer();
}

void StandInDevice::enable_force(bool on) {
  if (!on) return brake(kSoftware);
  if (state.mode != ForceDimensionMode::kForce) {
    fed_s_ = state.time_s;
    state.brought_back_N = target_N_ = state.command_N;
  }
  change_to(ForceDimensionMode::kForce);
  state.force_off_cause = kNoCause;
}

void StandInDevice::brake(int cause) {
  if (state.mode != ForceDimensionMode::kReset) change_to(ForceDimensionMode::kBrake);
  state.force_off_cause = cause;
  state.motor_N = target_N_ = arriving_N_ = {};
  if (!script.brake_keeps_command) state.command_N = {};
}

void StandInDevice::lose_power() {
  script.calibrated = false;
  change_to(ForceDimensionMode::kReset);
  brake(kUnplugged);
  state.command_N = {};
  state.watchdog_ticks = 0;
}

bool StandInDevice::set_force(const Axes& force_N) {
  ++state.force_calls;
  fed_s_ = state.time_s;
  const bool on = state.mode == ForceDimensionMode::kForce;
  if (!on && !script.brake_keeps_command) return false;
  state.command_N = force_N;
  const auto scale = [](Axes& vector, double limit_N) {
    const double magnitude_N = norm(vector);
    if (magnitude_N <= limit_N) return false;
    for (double& component_N : vector) component_N *= limit_N / magnitude_N;
    return true;
  };
  if (state.max_force_N >= 0.0) scale(state.command_N, state.max_force_N);
  if (!on) return false;
  target_N_ = state.command_N;
  if (state.gravity_compensation) target_N_[2] += state.effector_mass_kg * kGravity_m_per_s2;
  return scale(target_N_, kMotorLimit_N);
}

bool StandInDevice::read_guarded() {
  const bool guarded =
      read_s_ >= 0.0 && (script.pose_is_stuck || state.time_s - read_s_ < time_guard_us_ * 1e-6);
  if (guarded) return true;
  read_s_ = state.time_s;
  guarded_position_m_ =
      script.calibrated ? quantised(transferred_.position_m, kPositionStep_m) : kUncalibrated_m;
  guarded_wrist_rad_ = quantised(transferred_.wrist_rad, kAngleStep_rad);
  return false;
}

double StandInDevice::force_rate_kHz() {
  const double passed_s = state.time_s - std::exchange(asked_s_, state.time_s);
  const long calls = state.force_calls - std::exchange(asked_calls_, state.force_calls);
  return passed_s > 0.0 ? static_cast<double>(calls) / passed_s * 1e-3 : 0.0;
}

void StandInDevice::advance(double seconds) {
  const auto steps = static_cast<long>(std::lround(seconds / kStep_s));
  for (long i = 0; i < steps; ++i) step(kStep_s);
}

void StandInDevice::transfer() {
  transferred_ = transferring_;
  transferring_ = {state.position_m, script.wrist_rad};
  arriving_N_ = target_N_;
  transfer_s_ = state.time_s;
}

void StandInDevice::step(double step_s) {
  state.time_s += step_s;
  if (!script.powered) {
    lose_power();
  } else if (state.mode == ForceDimensionMode::kForce) {
    const double watchdog_s = state.watchdog_ticks * kWatchdogTick_s;
    const double threshold_m_per_s = script.velocity_threshold_mm_per_s * 1e-3;
    if (!script.connected) {
      brake(kUnplugged);
    } else if (state.watchdog_ticks > 0 && state.time_s - fed_s_ > watchdog_s && !state.regulation) {
      brake(kWatchdog);
    } else if (threshold_m_per_s > 0.0 && norm(state.velocity_m_per_s) > threshold_m_per_s) {
      brake(kVelocity);
    }
  }
  if (script.connected && state.time_s - transfer_s_ > kTransfer_s - 0.5 * step_s) transfer();
  move(step_s);
}

void StandInDevice::move(double step_s) {
  const bool braked = state.mode == ForceDimensionMode::kBrake;
  const double damping_Ns_per_m = kViscous_Ns_per_m + (braked ? kBrake_Ns_per_m : 0.0);
  const double mass_kg = kMass_kg + (script.hand_holds ? kHandMass_kg : 0.0);
  Axes rendered_N = state.motor_N;
  if (state.gravity_compensation) rendered_N[2] -= state.effector_mass_kg * kGravity_m_per_s2;
  if (state.mode == ForceDimensionMode::kForce && norm(state.command_N) > 0.0)
    state.largest_motor_N = std::max(state.largest_motor_N, norm(rendered_N));

  for (std::size_t i = 0; i < 3; ++i) {
    double& position_m = state.position_m[i];
    double& velocity_m_per_s = state.velocity_m_per_s[i];
    double& motor_N = state.motor_N[i];
    motor_N += (arriving_N_[i] - motor_N) * std::min(1.0, kMotorPole_rad_per_s * step_s);

    double force_N = motor_N + script.hand_N[i] - (i == 2 ? kMass_kg * kGravity_m_per_s2 : 0.0);
    if (script.hand_holds) {
      force_N += script.hand_stiffness_N_per_m * (script.hand_m[i] - position_m) -
                 script.hand_damping_N_s_per_m * velocity_m_per_s;
    }
    // Implicit in the damper, which is stiff while braked.
    velocity_m_per_s =
        (velocity_m_per_s + step_s * force_N / mass_kg) / (1.0 + step_s * damping_Ns_per_m / mass_kg);
    const double stuck_m_per_s = kCoulomb_N * step_s / mass_kg;
    velocity_m_per_s -= std::clamp(velocity_m_per_s, -stuck_m_per_s, stuck_m_per_s);
    position_m += velocity_m_per_s * step_s;
    if (std::abs(position_m) > kWorkspace_m) {
      position_m = std::copysign(kWorkspace_m, position_m);
      velocity_m_per_s = 0.0;
    }
  }
}

}  // namespace sim::devices
