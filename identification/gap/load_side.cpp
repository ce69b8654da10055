#include "identification/gap/load_side.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace identification::gap {
namespace {

/// Less would ring for ever after the first sample, whose state nobody knows.
constexpr double kLeastDampingRatio = 0.02;
constexpr double kStepsPerRadian = 12;
constexpr double kGapStep_s = 1e-3;
/// A shaft that resonates so many times above the filter is rigid as far as the data can tell.
constexpr double kRigidOverFilter = 4;

/// The motor between two samples, from position and velocity at both.
struct Stretch {
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

/// Velocity after friction has worked against it: it stops a motion, it does not turn it round.
double rubbed(double velocity, double forward, double backward) {
  if (velocity > 0) return std::max(velocity - forward, 0.0);
  return std::min(velocity + backward, 0.0);
}

}  // namespace

std::vector<double> load_side_Nm(const model::effects::Mechanics& mechanics,
                                 const model::effects::EffectChain& chain, const Signals& s,
                                 std::span<const double> pull_Nm) {
  std::vector<double> result(s.size());
  if (s.size() < 2) return result;
  const double inertia = mechanics.inertia_kg_m2;
  const double half_gap = 0.5 * mechanics.backlash_rad;
  // Per unit of inertia: the load's share cancels in its own motion.
  const double load_inertia = mechanics.load_share * inertia;
  const double stiffness = mechanics.shaft_Nm_per_rad / load_inertia;
  const double resonance = std::sqrt(stiffness);
  const bool spring = stiffness > 0 && resonance < kRigidOverFilter * 2 * std::numbers::pi * s.filter_Hz;
  const double damping =
      std::max(2 * kLeastDampingRatio * resonance, mechanics.shaft_Nm_s_per_rad / load_inertia);
  const double most_step_s = spring ? std::min(1 / (kStepsPerRadian * resonance), s.period_s) : kGapStep_s;
  const auto steps = static_cast<int>(std::ceil(std::max(1.0, s.period_s / most_step_s)));
  const double dt = s.period_s / steps;

  double position = s.position_rad[0];
  double velocity = s.velocity_rad_per_s[0];
  for (std::size_t i = 1; i < s.size(); ++i) {
    const Stretch motor{s.position_rad[i - 1], s.velocity_rad_per_s[i - 1], s.position_rad[i],
                        s.velocity_rad_per_s[i], s.period_s};
    const double speed = std::abs(s.velocity_rad_per_s[i]);
    const double carried = std::abs(pull_Nm[i]);
    const double forward = chain.level_Nm(speed, +1, s.running_s[i], carried) / inertia * dt;
    const double backward = chain.level_Nm(speed, -1, s.running_s[i], carried) / inertia * dt;
    const double falling = -pull_Nm[i] / load_inertia * dt;
    double acceleration = 0;  // that the motor gives to the load, mean
    for (int n = 1; n <= steps; ++n) {
      const double share = static_cast<double>(n) / steps;
      const double motor_position = motor.position(share);
      const double motor_velocity = motor.velocity(share);
      if (spring) {
        const double twist = motor_position - position;
        const double pressed = twist - std::clamp(twist, -half_gap, half_gap);
        const double loss = pressed != 0 || half_gap == 0 ? damping : 0;
        // Implicit in the damping, which may be strong.
        const double pulled =
            (velocity + falling + dt * (stiffness * pressed + loss * motor_velocity)) / (1 + dt * loss);
        acceleration += (pulled - falling - velocity) / dt;
        velocity = rubbed(pulled, forward, backward);
        position += dt * velocity;
        continue;
      }
      const double coasting = rubbed(velocity + falling, forward, backward);
      const double reach = motor_position - (position + dt * coasting);
      if (std::abs(reach) <= half_gap) {
        velocity = coasting;
        position += dt * velocity;
      } else {
        // On the flank: what takes the load along is what it does not do by itself.
        acceleration += (motor_velocity - velocity - falling) / dt;
        // Friction that the motor has to overcome, as far as the load slides.
        if (motor_velocity != 0) acceleration += (motor_velocity > 0 ? forward : -backward) / dt;
        velocity = motor_velocity;
        position = motor_position - std::copysign(half_gap, reach);
      }
    }
    result[i] = inertia * acceleration / steps;
  }
  return result;
}

}  // namespace identification::gap
