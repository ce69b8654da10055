#include "identification/gap/load_side.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "identification/gap/between_flanks.h"
#include "identification/gap/zero_phase.h"

namespace identification::gap {
namespace {

/// With less it would ring forever after the first sample, whose state is unknown.
constexpr double kMinDampingRatio = 0.02;
constexpr double kStepsPerRadian = 12;
/// A shaft whose resonance is this many times above the filter is rigid for the data.
constexpr double kRigidOverFilter = 4;

/// For a gap before a rigid shaft.
constexpr double kGapStep_s = 1e-3;

/// Rate at which the simulated motor is drawn to the measured one, relative to the band: slower than a
/// bounce, so that it does not suppress rebounds, and faster than the position error from a torque sensor's
/// drift.
constexpr double kFollowsOverBand = 0.4;

/// Relative to a period of the band: shorter flights look like contact in the data.
constexpr double kShortestFlightInBand = 0.5;
/// A shorter bounce, relative to such a period, ends in the simulation.
constexpr double kShortestBounceInBand = 0.1;

/// The motor between two samples, from position and velocity at both.
struct MotorStretch {
  double x0, v0, x1, v1, period_s;

  double position(double share) const {
    const double d = x1 - x0;
    const double a = v0 * period_s;
    const double b = v1 * period_s;
    return x0 + share * (a + share * ((3 * d - 2 * a - b) + share * (a + b - 2 * d)));
  }
  double velocity(double share) const {
    const double d = x1 - x0;
    const double a = v0 * period_s;
    const double b = v1 * period_s;
    return (a + share * (2 * (3 * d - 2 * a - b) + share * 3 * (a + b - 2 * d))) / period_s;
  }
};
MotorStretch stretch_before(const Signals& s, std::size_t i) {
  return {s.position_rad[i - 1], s.velocity_rad_per_s[i - 1], s.position_rad[i], s.velocity_rad_per_s[i],
          s.period_s};
}

Levels levels_at(const model::effects::Mechanics& mechanics, const model::effects::EffectChain& chain,
                 const Signals& s, std::size_t i, double load_Nm) {
  const model::effects::Slide slide = slide_at(s, i, load_Nm, mechanics.inertia_kg_m2);
  return {chain.level_Nm(towards(slide, +1)), chain.level_Nm(towards(slide, -1))};
}

/// Converts means over the periods before each sample to means around it. The first sample has no period
/// before it.
void centre(std::vector<double>& means) {
  means.front() = means[1];
  for (std::size_t i = 0; i + 1 < means.size(); ++i) means[i] = 0.5 * (means[i] + means[i + 1]);
}

LoadSide behind_spring(const model::effects::Mechanics& mechanics, const model::effects::EffectChain& chain,
                       const Signals& s, const Pulls& pulls) {
  const double inertia = mechanics.load_share * mechanics.inertia_kg_m2;
  const double half_gap = 0.5 * mechanics.backlash_rad;
  const double stiffness = mechanics.shaft_Nm_per_rad / inertia;
  const double resonance = std::sqrt(stiffness);
  const bool rigid = resonance >= kRigidOverFilter * 2 * std::numbers::pi * s.filter_Hz;
  const double damping = std::max(2 * kMinDampingRatio * resonance, mechanics.shaft_Nm_s_per_rad / inertia);
  const double most_step_s = std::min(s.period_s, !rigid         ? 1 / (kStepsPerRadian * resonance)
                                                  : half_gap > 0 ? kGapStep_s
                                                                 : s.period_s);
  const auto steps = static_cast<int>(std::ceil(std::max(1.0, s.period_s / most_step_s)));
  const double dt = s.period_s / steps;
  const double rubs = mechanics.friction_share() / inertia * dt;

  const std::vector<double> none(s.size());
  LoadSide load{none, none, none, none};
  double position = s.position_rad[0];
  double velocity = s.velocity_rad_per_s[0];
  for (std::size_t i = 1; i < s.size(); ++i) {
    const MotorStretch motor = stretch_before(s, i);
    const Levels level = levels_at(mechanics, chain, s, i, pulls.load_Nm[i]);
    const double falling = -pulls.load_Nm[i] / inertia * dt;
    double acceleration = 0;  // of the load by the motor, mean
    for (int n = 1; n <= steps; ++n) {
      const double share = static_cast<double>(n) / steps;
      const double motor_velocity = motor.velocity(share);
      if (rigid) {
        const double coasting = rubbed(velocity + falling, level, rubs);
        const double reach = motor.position(share) - (position + dt * coasting);
        if (half_gap > 0 && std::abs(reach) <= half_gap) {
          velocity = coasting;
          position += dt * velocity;
          continue;
        }
        acceleration += (motor_velocity - velocity - falling) / dt;
        // Friction that the motor must overcome where the load slides.
        if (motor_velocity != 0)
          acceleration += rubs * (motor_velocity > 0 ? level.forward_Nm : -level.backward_Nm) / dt;
        velocity = motor_velocity;
        position = motor.position(share) - std::copysign(half_gap, reach);
        continue;
      }
      const double twist = motor.position(share) - position;
      const double pressed = twist - std::clamp(twist, -half_gap, half_gap);
      const double loss = pressed != 0 || half_gap == 0 ? damping : 0;
      // Implicit in the damping, which may be strong.
      const double pulled =
          (velocity + falling + dt * (stiffness * pressed + loss * motor_velocity)) / (1 + dt * loss);
      acceleration += (pulled - falling - velocity) / dt;
      velocity = rubbed(pulled, level, rubs);
      position += dt * velocity;
    }
    load.simulated_Nm[i] = inertia * acceleration / steps;
    load.twist_rad[i] = s.position_rad[i] - position;
    load.twist_rate_rad_per_s[i] = s.velocity_rad_per_s[i] - velocity;
  }
  centre(load.simulated_Nm);
  return load;
}

LoadSide behind_gap(const model::effects::Mechanics& mechanics, const model::effects::EffectChain& chain,
                    const Signals& s, const Pulls& pulls) {
  const double inertia = mechanics.load_share * mechanics.inertia_kg_m2;
  const auto steps = static_cast<int>(std::ceil(s.period_s / BetweenFlanks::longest_step_s(mechanics)));
  const double dt = s.period_s / steps;
  // Critically damped.
  const double follows = kFollowsOverBand * 2 * std::numbers::pi * s.band_Hz;

  const std::vector<double> none(s.size());
  LoadSide load{none, std::vector<double>(s.size(), 1), none, none};
  std::vector<double> motor_velocity(s.velocity_rad_per_s);
  std::vector<double> friction_Nm(s.size());
  const double shortest_s = kShortestFlightInBand / s.band_Hz;
  double flown_s = 0;
  const auto land = [&](std::size_t at) {
    if (flown_s > shortest_s)
      for (std::size_t k = 0; k <= at && static_cast<double>(k) * s.period_s < flown_s; ++k)
        load.contact_share[at - k] = 0;
    flown_s = 0;
  };
  BetweenFlanks masses(mechanics, kShortestBounceInBand / s.band_Hz, s.position_rad[0],
                       s.velocity_rad_per_s[0]);
  for (std::size_t i = 1; i < s.size(); ++i) {
    const MotorStretch measured = stretch_before(s, i);
    const Levels level = levels_at(mechanics, chain, s, i, pulls.load_Nm[i]);
    const double drive_before = pulls.drive_Nm[i - 1] - pulls.motor_Nm[i - 1];
    const double drive_rise = pulls.drive_Nm[i] - pulls.motor_Nm[i] - drive_before;
    const auto push_at = [&](double share) {
      return BetweenFlanks::Push{drive_before + share * drive_rise, pulls.load_Nm[i],
                                 follows * (follows * (measured.position(share) - masses.motor_rad()) +
                                            2 * (measured.velocity(share) - masses.motor_rad_per_s()))};
    };
    BetweenFlanks::Impulse sum;
    for (int n = 0; n < steps;) {
      const int left = masses.in_contact() ? steps - n : 1;
      const BetweenFlanks::Push push = push_at((n + 0.5 * (left + 1)) / steps);
      if (masses.in_contact() && !masses.keeps_contact(push, level, left * dt)) continue;
      const BetweenFlanks::Impulse given = masses.in_contact()
                                               ? masses.step_in_contact(push, level, left * dt)
                                               : masses.bounce(push, level, dt);
      sum.flank += given.flank;
      sum.friction += given.friction;
      if (masses.touches())
        land(i);
      else
        flown_s += dt;
      n += left;
    }
    load.simulated_Nm[i] = sum.flank / s.period_s;
    friction_Nm[i] = sum.friction / s.period_s;
    load.twist_rad[i] = masses.twist_rad();
    load.twist_rate_rad_per_s[i] = masses.motor_rad_per_s() - masses.load_rad_per_s();
    motor_velocity[i] = masses.motor_rad_per_s();
  }
  centre(load.simulated_Nm);
  centre(friction_Nm);
  land(s.size() - 1);
  load.contact_share = zero_phase(load.contact_share, s.period_s, s.band_Hz);
  const std::vector<double> motor_acceleration = derivative(motor_velocity, s.period_s);
  for (std::size_t i = 0; i < s.size(); ++i) {
    load.contact_share[i] = std::clamp(load.contact_share[i], 0.0, 1.0);
    // In contact only the twist is taken from the simulation, without its inertia, friction and load.
    load.simulated_Nm[i] -=
        load.contact_share[i] * (inertia * motor_acceleration[i] + friction_Nm[i] + pulls.load_Nm[i]);
  }
  return load;
}

}  // namespace

LoadSide load_side(const model::effects::Mechanics& mechanics, const model::effects::EffectChain& chain,
                   const Signals& s, const Pulls& pulls) {
  const std::vector<double> none(s.size());
  if (s.size() < 2) return {none, none, none, none};
  return mechanics.shaft_Nm_per_rad > 0 ? behind_spring(mechanics, chain, s, pulls)
                                        : behind_gap(mechanics, chain, s, pulls);
}

std::vector<double> torque_on_motor_Nm(const LoadSide& load, const model::effects::Mechanics& mechanics,
                                       const Signals& s, std::span<const double> friction_Nm,
                                       std::span<const double> load_Nm) {
  std::vector<double> torque = load.simulated_Nm;
  const double inertia = mechanics.load_share * mechanics.inertia_kg_m2;
  for (std::size_t i = 0; i < s.size(); ++i)
    torque[i] += load.contact_share[i] * (inertia * s.acceleration_rad_per_s2[i] +
                                          mechanics.friction_share() * friction_Nm[i] + load_Nm[i]);
  return torque;
}

}  // namespace identification::gap
