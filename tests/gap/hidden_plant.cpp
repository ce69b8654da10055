#include "tests/gap/hidden_plant.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

namespace gap_test {
namespace {

constexpr double kStep_s = HiddenPlant::kSample_s / HiddenPlant::kSubsteps;

// maxon EC 45 flat 50 W (251601) behind a 26:1 gear.
constexpr double kResistance_ohm = 0.978;
constexpr double kInductance_H = 0.573e-3;
constexpr double kGear = 26;
constexpr double kTorque_Nm_per_A = 33.5e-3 * kGear;
constexpr double kSupply_V = 24;

constexpr double kContactDampingRatio = 0.3;
constexpr double kGearDampingRatio = 0.1;
constexpr double kSoftShaftDampingRatio = 0.04;
constexpr double kCouplingHz = 80;
constexpr double kTeethHz = 250;
// All the speed of an impact at 0.5 rad/s is lost, half of it at 0.25. [Hunt, Crossley 1975: 3(1 − e)/(2v)]
constexpr double kTeethLoss_s_per_rad = 3;
constexpr double kSecondCoggingHarmonic = 0.3;
// Below it friction is what holds, not what slides.
constexpr double kSliding_rad_per_s = 0.02;
constexpr double kWalkTime_s = 4;

double square(double x) { return x * x; }

/// Share of a movement by which the contact slips: elastic up to part of the way, then gradually plastic.
/// [after Dupont et al. 2002]
double slip_share(double deflection, double limit, double movement) {
  if (deflection * movement <= 0) return 0;
  const double way = std::clamp((std::abs(deflection) / limit - 0.6) / 0.4, 0.0, 1.0);
  return way * way * (3 - 2 * way);
}

/// What a drive without `part_Nm` of friction would need less; `friction_Nm` is that of the contact.
double part_of_friction(double friction_Nm, double level_Nm, double part_Nm, double velocity_rad_per_s) {
  if (std::abs(velocity_rad_per_s) > kSliding_rad_per_s) return std::copysign(part_Nm, velocity_rad_per_s);
  const double without = std::max(level_Nm - part_Nm, 0.0);
  return std::clamp(friction_Nm, -level_Nm, level_Nm) - std::clamp(friction_Nm, -without, without);
}

}  // namespace

std::string_view name_of(Hidden kind) {
  static constexpr std::array<std::string_view, kHiddenKinds> kNames{"stribeck",
                                                                     "direction_asymmetry",
                                                                     "midspeed_dip",
                                                                     "quadratic_drag",
                                                                     "presliding",
                                                                     "cogging",
                                                                     "imbalance",
                                                                     "inertia",
                                                                     "backlash",
                                                                     "elasticity",
                                                                     "thermal_drift",
                                                                     "torque_offset",
                                                                     "torque_deadband",
                                                                     "transport_delay",
                                                                     "unsigned_current",
                                                                     "load_friction",
                                                                     "push",
                                                                     "cyclic_load",
                                                                     "loose_coupling",
                                                                     "sticking_brush",
                                                                     "random_walk"};
  return kNames.at(static_cast<std::size_t>(kind));
}

double& HiddenEffects::amount(Hidden kind) {
  switch (kind) {
    case Hidden::kStribeck: return stribeck_Nm;
    case Hidden::kDirectionAsymmetry: return asymmetry_Nm;
    case Hidden::kMidspeedDip: return dip_Nm;
    case Hidden::kQuadraticDrag: return drag_Nm_s2_per_rad2;
    case Hidden::kPresliding: return contact_rad_per_Nm;
    case Hidden::kCogging: return cogging_Nm;
    case Hidden::kImbalance: return imbalance_Nm;
    case Hidden::kInertia: return inertia_kg_m2;
    case Hidden::kBacklash: return gap_rad;
    case Hidden::kElasticity: return shaft_rad_per_Nm;
    case Hidden::kThermalDrift: return warm_share;
    case Hidden::kTorqueOffset: return offset_Nm;
    case Hidden::kTorqueDeadband: return deadband_Nm;
    case Hidden::kTransportDelay: return delay_s;
    case Hidden::kUnsignedCurrent: return unsigned_current;
    case Hidden::kLoadFriction: return load_friction;
    case Hidden::kPush: return push_Nm;
    case Hidden::kCyclicLoad: return cyclic_Nm;
    case Hidden::kLooseCoupling: return coupling_per_Nm;
    case Hidden::kStickingBrush: return brush_Nm;
    case Hidden::kRandomWalk: return walk_Nm;
  }
  throw std::invalid_argument("no such hidden effect");
}

double Sensors::noise_floor_Nm() const {
  return std::sqrt(square(torque_noise_Nm) + square(torque_step_Nm) / 12);
}

HiddenPlant::HiddenPlant(const Plant& plant, const HiddenEffects& effects, const Sensors& sensors,
                         std::uint64_t seed, double running_s)
    : plant_(plant),
      effects_(effects),
      sensors_(sensors),
      disturbance_chance_(seed ^ 0xD157u),
      noise_chance_(seed ^ 0x5E50u),
      current_decay_(std::exp(-kResistance_ohm / kInductance_H * kStep_s)),
      lag_gain_(sensors.torque_lag_s > 0 ? -std::expm1(-kStep_s / sensors.torque_lag_s) : 1),
      running_s_(running_s),
      command_gain_(effects.command_lag_s > 0 ? -std::expm1(-kStep_s / effects.command_lag_s) : 1) {
  const bool two_masses = effects.gap_rad > 0 || effects.shaft_rad_per_Nm > 0 || effects.coupling_per_Nm > 0;
  const double share = two_masses ? effects.load_share : plant.load_share;
  const double inertia = plant.inertia_kg_m2 + effects.inertia_kg_m2;
  const auto mass = [&](double inertia_share, double friction_share) {
    Mass result{inertia_share * inertia, friction_share, 0, 0};
    result.contact_Nm_per_rad = effects.contact_rad_per_Nm > 0
                                    ? friction_share / effects.contact_rad_per_Nm
                                    : result.inertia_kg_m2 * square(2 * kPi * plant.contact_Hz);
    result.contact_Nm_s_per_rad =
        2 * kContactDampingRatio * std::sqrt(result.contact_Nm_per_rad * result.inertia_kg_m2);
    return result;
  };
  motor_ = mass(1 - share, 1 - plant.load_friction_share);
  load_ = mass(share, plant.load_friction_share);

  const double reduced = inertia * share * (1 - share);
  double damping_ratio = kGearDampingRatio;
  shaft_Nm_per_rad_ = reduced * square(2 * kPi * plant.gear_Hz);
  if (effects.gap_rad > 0) shaft_Nm_per_rad_ = reduced * square(2 * kPi * kTeethHz);
  if (effects.coupling_per_Nm > 0) shaft_Nm_per_rad_ = reduced * square(2 * kPi * kCouplingHz);
  if (effects.shaft_rad_per_Nm > 0) {
    shaft_Nm_per_rad_ = 1 / effects.shaft_rad_per_Nm;
    damping_ratio = kSoftShaftDampingRatio;
  }
  shaft_Nm_s_per_rad_ = 2 * damping_ratio * std::sqrt(shaft_Nm_per_rad_ * reduced);

  motor_.position_rad = load_.position_rad = disturbance_chance_.uniform(-kPi, kPi);
  shadow_position_rad_ = motor_.position_rad;
  walk_Nm_ = effects.walk_Nm * disturbance_chance_.normal();
  noise_Nm_ = sensors.torque_noise_Nm * noise_chance_.normal();
  next_event_s_ = disturbance_chance_.uniform(0.5, 3);
  cyclic_phase_rad_ = disturbance_chance_.uniform(-kPi, kPi);
  measure();
}

double HiddenPlant::kinetic_J() const {
  return 0.5 * (motor_.inertia_kg_m2 * square(motor_.velocity_rad_per_s) +
                load_.inertia_kg_m2 * square(load_.velocity_rad_per_s));
}

HiddenPlant::Level HiddenPlant::level(double velocity_rad_per_s, double direction) const {
  const double speed = std::abs(velocity_rad_per_s);
  Level result{plant_.coulomb_Nm, 0, direction * effects_.asymmetry_Nm, 0, 0, brush_Nm_};
  if (effects_.stribeck_Nm != 0)
    result.stribeck_Nm = effects_.stribeck_Nm / (1 + square(speed / effects_.stribeck_rad_per_s));
  const double off = (speed - effects_.dip_centre_rad_per_s) / effects_.dip_half_width_rad_per_s;
  if (effects_.dip_Nm != 0 && std::abs(off) < 1)
    result.dip_Nm = -0.5 * effects_.dip_Nm * (1 + std::cos(kPi * off));
  if (effects_.load_friction != 0)
    result.load_Nm = effects_.load_friction * std::abs(load_Nm(load_.position_rad));
  return result;
}

double HiddenPlant::slide_level_Nm(const Mass& mass) const {
  const double direction = mass.velocity_rad_per_s != 0 ? mass.velocity_rad_per_s : mass.deflection_rad;
  return std::max(warmth_ * level(mass.velocity_rad_per_s, direction < 0 ? -1 : 1).sum_Nm(),
                  0.02 * plant_.coulomb_Nm);
}

void HiddenPlant::rub(Mass& mass) {
  const double limit = mass.friction_share * slide_level_Nm(mass) / mass.contact_Nm_per_rad;
  const double movement = mass.velocity_rad_per_s * kStep_s;
  const double before = mass.deflection_rad;
  // dz = dx − a·|dx|·z/limit, exact for this a.
  const double decay = slip_share(before, limit, movement) * std::abs(movement) / limit;
  double after = before + movement;
  if (decay > 1e-9) {
    const double left = decay < 30 ? std::exp(-decay) : 0;
    after = before * left + movement * (1 - left) / decay;
  }
  mass.deflection_rad = std::clamp(after, -limit, limit);
  mass.friction_Nm = mass.contact_Nm_per_rad * mass.deflection_rad +
                     mass.contact_Nm_s_per_rad * (mass.deflection_rad - before) / kStep_s;
}

double HiddenPlant::drag_Nm(double velocity_rad_per_s) const {
  return warmth_ * velocity_rad_per_s *
         (plant_.viscous_Nm_s_per_rad + effects_.drag_Nm_s2_per_rad2 * std::abs(velocity_rad_per_s));
}

double HiddenPlant::delivered_command_Nm(double at_s) const {
  // A command holds from its time on; the small part of a step keeps whole periods from being cut by
  // rounding.
  const double periods = (at_s - effects_.delay_s) / kSample_s + 1e-6;
  if (periods < 0) return 0;
  const double command = commands_Nm_[std::min(static_cast<std::size_t>(periods), commands_Nm_.size() - 1)];
  if (command == 0 || std::abs(command) >= effects_.deadband_Nm) return command;
  return std::copysign(effects_.deadband_Nm, command);
}

void HiddenPlant::drive_current(double command_Nm) {
  // Zero of the controller on the pole of the winding.
  const double loop_rad_per_s = 2 * kPi * plant_.current_loop_Hz;
  const double error_A = command_Nm / kTorque_Nm_per_A - current_A_;
  const double wanted_V = loop_rad_per_s * kInductance_H * error_A + integral_V_;
  const double voltage_V = std::clamp(wanted_V, -kSupply_V, kSupply_V);
  if (voltage_V == wanted_V) integral_V_ += loop_rad_per_s * kResistance_ohm * error_A * kStep_s;
  const double induced_V = kTorque_Nm_per_A * motor_.velocity_rad_per_s;
  const double settled_A = (voltage_V - induced_V) / kResistance_ohm;
  current_A_ = settled_A + (current_A_ - settled_A) * current_decay_;
}

double HiddenPlant::shaft_Nm() {
  const double twist = motor_.position_rad - load_.position_rad;
  const double twist_rad_per_s = motor_.velocity_rad_per_s - load_.velocity_rad_per_s;
  if (effects_.gap_rad > 0) {
    const double pressed = twist - std::clamp(twist, -0.5 * effects_.gap_rad, 0.5 * effects_.gap_rad);
    const double closing = std::copysign(1.0, pressed) * twist_rad_per_s;
    return shaft_Nm_per_rad_ * pressed * std::max(1 + kTeethLoss_s_per_rad * closing, 0.0);
  }
  if (effects_.coupling_per_Nm > 0) {
    const double limit = 1 / effects_.coupling_per_Nm;
    const double torque = shaft_Nm_per_rad_ * (twist - slipped_rad_);
    if (std::abs(torque) > limit) {
      slipped_rad_ = twist - std::copysign(limit, torque) / shaft_Nm_per_rad_;
      return std::copysign(limit, torque);
    }
    return torque + shaft_Nm_s_per_rad_ * twist_rad_per_s;
  }
  return shaft_Nm_per_rad_ * twist + shaft_Nm_s_per_rad_ * twist_rad_per_s;
}

double HiddenPlant::cogging_Nm(double position_rad) const {
  if (effects_.cogging_Nm == 0) return 0;
  const double angle = effects_.cogging_per_rev * position_rad + effects_.cogging_phase_rad;
  return effects_.cogging_Nm * (std::sin(angle) + kSecondCoggingHarmonic * std::sin(2 * angle + 1));
}

double HiddenPlant::load_Nm(double position_rad) const {
  double result = effects_.offset_Nm;
  if (effects_.imbalance_Nm != 0)
    result += effects_.imbalance_Nm * std::sin(position_rad - effects_.imbalance_rest_rad);
  return result;
}

void HiddenPlant::disturb() {
  const bool push = effects_.push_Nm != 0;
  if ((push || effects_.brush_Nm != 0) && time_s_ >= next_event_s_) {
    event_from_s_ = time_s_;
    event_until_s_ =
        time_s_ + (push ? disturbance_chance_.uniform(0.3, 1) : disturbance_chance_.uniform(0.05, 0.3));
    event_Nm_ = disturbance_chance_.uniform(0.6, 1.4) *
                (push ? disturbance_chance_.sign() * effects_.push_Nm : effects_.brush_Nm);
    next_event_s_ =
        event_until_s_ + (push ? disturbance_chance_.uniform(1, 5) : disturbance_chance_.uniform(0.2, 2));
  }
  const bool during = time_s_ < event_until_s_;
  brush_Nm_ = during && !push ? event_Nm_ : 0;
  outside_Nm_ = 0;
  if (during && push)  // a hand comes and goes in a tenth of a second
    outside_Nm_ +=
        event_Nm_ * std::min({1.0, (time_s_ - event_from_s_) / 0.1, (event_until_s_ - time_s_) / 0.1});
  if (effects_.cyclic_Nm != 0)
    outside_Nm_ += effects_.cyclic_Nm * std::sin(2 * kPi * effects_.cyclic_Hz * time_s_ + cyclic_phase_rad_);
  if (effects_.walk_Nm != 0) {
    const double left = std::exp(-kSample_s / kWalkTime_s);
    walk_Nm_ = left * walk_Nm_ + effects_.walk_Nm * std::sqrt(1 - left * left) * disturbance_chance_.normal();
    outside_Nm_ += walk_Nm_;
  }
  warmth_ = 1 + effects_.warm_share * -std::expm1(-(running_s_ + time_s_) / effects_.warm_time_s);
}

void HiddenPlant::substep(double command_Nm) {
  const auto kick = [](Mass& mass) {
    mass.velocity_rad_per_s += 0.5 * kStep_s * mass.acceleration_rad_per_s2;
  };
  kick(motor_);
  kick(load_);
  motor_.position_rad += kStep_s * motor_.velocity_rad_per_s;
  load_.position_rad += kStep_s * load_.velocity_rad_per_s;
  rub(motor_);
  rub(load_);
  drive_current(command_Nm);
  torque_Nm_ = kTorque_Nm_per_A * current_A_;
  transmitted_Nm_ = shaft_Nm();

  const double motor_rub = motor_.friction_Nm + motor_.friction_share * drag_Nm(motor_.velocity_rad_per_s);
  const double load_rub = load_.friction_Nm + load_.friction_share * drag_Nm(load_.velocity_rad_per_s);
  motor_work_J_ += torque_Nm_ * motor_.velocity_rad_per_s * kStep_s;
  friction_heat_J_ += (motor_rub * motor_.velocity_rad_per_s + load_rub * load_.velocity_rad_per_s) * kStep_s;

  motor_.acceleration_rad_per_s2 =
      (torque_Nm_ - motor_rub - transmitted_Nm_ - cogging_Nm(motor_.position_rad)) / motor_.inertia_kg_m2;
  load_.acceleration_rad_per_s2 =
      (transmitted_Nm_ - load_rub - load_Nm(load_.position_rad) - outside_Nm_) / load_.inertia_kg_m2;
  kick(motor_);
  kick(load_);
  lagged_torque_Nm_ += lag_gain_ * (torque_Nm_ - lagged_torque_Nm_);
}

void HiddenPlant::step(double command_Nm) {
  commands_Nm_.push_back(command_Nm);
  disturb();
  double missing_shaft_Nm = 0;
  double delivered_Nm = 0;
  for (int i = 0; i < kSubsteps; ++i) {
    filtered_command_Nm_ +=
        command_gain_ * (delivered_command_Nm(time_s_ + i * kStep_s) - filtered_command_Nm_);
    const double delivered = filtered_command_Nm_;
    substep(delivered);
    if (i + 1 == kSensedSubstep) measure();
    delivered_Nm += delivered / kSubsteps;
    const double rigid_Nm = load_.inertia_kg_m2 * motor_.acceleration_rad_per_s2 +
                            load_.friction_share / motor_.friction_share * motor_.friction_Nm +
                            load_.friction_share * drag_Nm(motor_.velocity_rad_per_s) +
                            load_Nm(motor_.position_rad) + outside_Nm_;
    missing_shaft_Nm += (transmitted_Nm_ - rigid_Nm) / kSubsteps;
  }
  time_s_ += kSample_s;
  account(command_Nm, missing_shaft_Nm, delivered_Nm);
}

void HiddenPlant::measure() {
  sensed_torque_Nm_ = torque_Nm_;
  const double tick = 2 * kPi / sensors_.encoder_ticks_per_rev;
  measured_position_rad_ = std::floor(motor_.position_rad / tick) * tick;

  const double kept =
      sensors_.noise_correlation_s > 0 ? std::exp(-kSample_s / sensors_.noise_correlation_s) : 0;
  noise_Nm_ =
      kept * noise_Nm_ + std::sqrt(1 - kept * kept) * sensors_.torque_noise_Nm * noise_chance_.normal();
  double torque = lagged_torque_Nm_ + noise_Nm_;
  if (sensors_.torque_step_Nm > 0)
    torque = std::round(torque / sensors_.torque_step_Nm) * sensors_.torque_step_Nm;
  measured_torque_Nm_ = effects_.unsigned_current != 0 ? std::abs(torque) : torque;
}

void HiddenPlant::account(double command_Nm, double missing_shaft_Nm, double delivered_Nm) {
  const auto at = [this](Hidden kind) -> double& {
    return contributions_Nm_[static_cast<std::size_t>(kind)];
  };
  contributions_Nm_.fill(0);
  const double velocity = motor_.velocity_rad_per_s;
  const double friction = motor_.friction_Nm / motor_.friction_share;
  const Level now = level(velocity, velocity < 0 ? -1 : 1);
  const double sum = warmth_ * now.sum_Nm();
  const auto part = [&](double part_Nm) {
    return part_of_friction(friction, sum, warmth_ * part_Nm, velocity);
  };
  at(Hidden::kStribeck) = part(now.stribeck_Nm);
  at(Hidden::kDirectionAsymmetry) = part(now.asymmetry_Nm);
  at(Hidden::kMidspeedDip) = part(now.dip_Nm);
  at(Hidden::kLoadFriction) = part(now.load_Nm);
  at(Hidden::kStickingBrush) = part(now.brush_Nm);
  at(Hidden::kThermalDrift) =
      part_of_friction(friction, sum, sum - now.sum_Nm(), velocity) + (1 - 1 / warmth_) * drag_Nm(velocity);
  at(Hidden::kQuadraticDrag) = warmth_ * effects_.drag_Nm_s2_per_rad2 * velocity * std::abs(velocity);
  at(Hidden::kCogging) = cogging_Nm(motor_.position_rad);
  at(Hidden::kTorqueOffset) = effects_.offset_Nm;
  at(Hidden::kImbalance) = load_Nm(load_.position_rad) - effects_.offset_Nm;
  at(Hidden::kInertia) = effects_.inertia_kg_m2 * motor_.acceleration_rad_per_s2;
  // Impacts between two samples do not show in positions: what counts is slower than 40 Hz.
  const double gain = -std::expm1(-2 * kPi * 40 * kSample_s);
  const bool slides = std::abs(velocity) > kSliding_rad_per_s;
  slow_shaft_Nm_[0] += gain * ((slides ? missing_shaft_Nm : 0) - slow_shaft_Nm_[0]);
  slow_shaft_Nm_[1] += gain * (slow_shaft_Nm_[0] - slow_shaft_Nm_[1]);
  if (effects_.gap_rad > 0) at(Hidden::kBacklash) = slow_shaft_Nm_[1];
  if (effects_.shaft_rad_per_Nm > 0) at(Hidden::kElasticity) = slow_shaft_Nm_[1];
  if (effects_.coupling_per_Nm > 0) at(Hidden::kLooseCoupling) = slow_shaft_Nm_[1];
  if (effects_.deadband_Nm > 0) at(Hidden::kTorqueDeadband) = delivered_Nm - command_Nm;
  if (effects_.delay_s > 0) at(Hidden::kTransportDelay) = delivered_Nm - command_Nm;
  if (effects_.unsigned_current != 0) at(Hidden::kUnsignedCurrent) = std::abs(torque_Nm_) - torque_Nm_;
  const double outside = outside_Nm_;
  if (effects_.push_Nm != 0) at(Hidden::kPush) = outside;
  if (effects_.cyclic_Nm != 0) at(Hidden::kCyclicLoad) = outside;
  if (effects_.walk_Nm != 0) at(Hidden::kRandomWalk) = outside;

  // Relative to a contact compliance of two ticks: below, the encoder hardly distinguishes it from a rigid
  // one.
  const double least = 2 * (2 * kPi / sensors_.encoder_ticks_per_rev);
  if (sum * effects_.contact_rad_per_Nm > least) {
    shadow_deflection_rad_ =
        std::clamp(shadow_deflection_rad_ + motor_.position_rad - shadow_position_rad_, -least, least);
    at(Hidden::kPresliding) = friction - sum * shadow_deflection_rad_ / least;
  }
  shadow_position_rad_ = motor_.position_rad;
}

}  // namespace gap_test
