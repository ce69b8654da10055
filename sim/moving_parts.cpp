#include "sim/moving_parts.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <utility>

namespace sim {
namespace {

/// Share of the friction contact, proportional to its friction.
BoundedBristle contact(const model::effects::Mechanics& mechanics, double share) {
  return BoundedBristle({mechanics.stiffness_Nm_per_rad * share, mechanics.damping_Nm_s_per_rad * share,
                         mechanics.bend_exponent});
}

const model::effects::Mechanics& with_contact(const model::effects::Mechanics& mechanics) {
  if (!(mechanics.stiffness_Nm_per_rad > 0))
    throw std::invalid_argument("simulated drive: the friction contact needs a stiffness");
  return mechanics;
}

}  // namespace

MovingParts::MovingParts(const model::effects::Mechanics& mechanics,
                         std::optional<model::friction::SlidingTable> curve,
                         const model::effects::EffectChain& effects)
    : mechanics_(with_contact(mechanics)),
      curve_(std::move(curve)),
      effects_(effects),
      motor_(mass(mechanics.two_masses() ? 1 - mechanics.load_share : 1,
                  mechanics.two_masses() ? 1 - mechanics.friction_share() : 1)),
      load_(mass(mechanics.load_share, mechanics.friction_share())) {}

MovingParts::Mass MovingParts::mass(double inertia_share, double friction_share) const {
  return {inertia_share * mechanics_.inertia_kg_m2, friction_share, contact(mechanics_, friction_share),
          std::vector<model::friction::State>(effects_.law_count())};
}

double MovingParts::longest_step_s() const noexcept {
  const double motor_s = effects_.longest_step_s(motor_.inertia_kg_m2, motor_.friction_share);
  return mechanics_.two_masses()
             ? std::min(motor_s, effects_.longest_step_s(load_.inertia_kg_m2, load_.friction_share))
             : motor_s;
}

/// Of the laws with memory.
double MovingParts::laws_Nm(Mass& mass, double torque_Nm, const Effort& effort,
                            double step_s) const noexcept {
  const double friction =
      effects_.laws_Nm(mass.laws, {mass.velocity_rad_per_s, torque_Nm / mass.friction_share}, step_s);
  const double speed = std::abs(mass.velocity_rad_per_s);
  return mass.friction_share *
         effects_.reduced_laws_Nm(friction, speed,
                                  contact_level_Nm(mass, speed, std::copysign(1.0, friction), effort));
}

double MovingParts::move(Mass& mass, double torque_Nm, const Effort& effort, double step_s) noexcept {
  const double speed = std::abs(mass.velocity_rad_per_s);
  double friction = mass.contact.step(
      mass.velocity_rad_per_s,
      [&](double direction) {
        return mass.friction_share * std::max(contact_level_Nm(mass, speed, direction, effort), 0.0);
      },
      step_s);
  if (!mass.laws.empty()) friction += laws_Nm(mass, torque_Nm, effort, step_s);
  const double before =
      std::exchange(mass.velocity_rad_per_s,
                    mass.velocity_rad_per_s + step_s / mass.inertia_kg_m2 * (torque_Nm - friction));
  mass.since_reversal_s = mass.velocity_rad_per_s * before <= 0 ? 0 : mass.since_reversal_s + step_s;
  mass.position_rad += step_s * mass.velocity_rad_per_s;
  return friction;
}

double MovingParts::shaft_torque_Nm(double step_s) const noexcept {
  const double twist = motor_.position_rad - load_.position_rad;
  const double rate = motor_.velocity_rad_per_s - load_.velocity_rad_per_s;
  const double half_gap = 0.5 * mechanics_.backlash_rad;
  if (std::abs(twist) <= half_gap && half_gap > 0) return 0;
  const double bent = twist - std::clamp(twist, -half_gap, half_gap);
  if (!(mechanics_.shaft_Nm_per_rad > 0)) return mechanics_.flank_Nm(bent, rate, step_s);
  const double torque = mechanics_.shaft_Nm_per_rad * bent + mechanics_.shaft_Nm_s_per_rad * rate;
  // Flanks only push.
  if (half_gap > 0 && torque * bent < 0) return 0;
  return torque;
}

void MovingParts::step(double motor_torque_Nm, double load_Nm, double step_s) noexcept {
  const double carried_Nm = effects_.empty() ? load_Nm : effects_.load_Nm(position_rad()) + load_Nm;
  const double motor_load_Nm = effects_.empty() ? 0 : effects_.motor_load_Nm(motor_.position_rad);
  const double gain = effects_.empty() ? 1 : effects_.motor_gain(motor_.position_rad);
  const Effort effort{gain * motor_torque_Nm - motor_load_Nm, carried_Nm};
  running_s_ += step_s;
  if (!mechanics_.two_masses()) {
    friction_torque_Nm_ = move(motor_, effort.motor_Nm - carried_Nm, effort, step_s);
    return;
  }
  const double shaft_Nm = shaft_torque_Nm(step_s);
  friction_torque_Nm_ = move(motor_, effort.motor_Nm - shaft_Nm, effort, step_s) +
                        move(load_, shaft_Nm - carried_Nm, effort, step_s);
}

void MovingParts::set_velocity(double velocity_rad_per_s) noexcept {
  motor_.velocity_rad_per_s = load_.velocity_rad_per_s = velocity_rad_per_s;
}

void MovingParts::set_laws(std::span<const model::friction::State> states) noexcept {
  std::ranges::copy(states, motor_.laws.begin());
  std::ranges::copy(states, load_.laws.begin());
}

void MovingParts::set_position(double position_rad) noexcept {
  motor_.position_rad = load_.position_rad = position_rad;
}

}  // namespace sim
