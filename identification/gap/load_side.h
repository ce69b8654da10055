/// @file
/// Torque that a load behind a gap or a spring exerts on the motor whose motion was measured.
#pragma once
#include <cmath>
#include <span>
#include <vector>

#include "identification/gap/signals.h"
#include "model/effects/effect.h"
#include "model/effects/effect_chain.h"

namespace identification::gap {

/// The joint at a sample, with the load's torque against positive motion.
inline model::effects::Slide slide_at(const Signals& s, std::size_t i, double load_Nm, double inertia_kg_m2) {
  return {.speed_rad_per_s = std::abs(s.velocity_rad_per_s[i]),
          .running_s = s.running_s[i],
          .position_rad = s.position_rad[i],
          .since_reversal_s = s.since_reversal_s[i],
          .load_Nm = load_Nm,
          .inertial_Nm = inertia_kg_m2 * s.acceleration_rad_per_s2[i]};
}
inline model::effects::Slide towards(model::effects::Slide slide, double direction) {
  slide.direction = direction;
  return slide;
}

/// Torques on a drive other than inertia and friction, at each sample.
struct Pulls {
  std::span<const double> drive_Nm;  ///< delivered by the actuator
  std::span<const double> motor_Nm;  ///< against positive motion of the motor
  std::span<const double> load_Nm;   ///< against positive motion of the load
};

/// At each sample.
struct LoadSide {
  std::vector<double>
      simulated_Nm;  ///< torque on the motor, mean around the sample, without the share of contact
  std::vector<double> contact_share;         ///< 1: the load moves with the measured motor, 0: it moves
                                             ///< freely
  std::vector<double> twist_rad;             ///< lead of the motor over the load
  std::vector<double> twist_rate_rad_per_s;  ///< its rate
};

/// The load of `mechanics`, simulated, because the motor's motion alone does not show how the load coasts
/// through a gap and rings on a spring.
///
/// Behind a spring it follows the measured motor. On the flanks of a gap it bounces, and the motor recoils:
/// the torque moves both, and they follow the measured motor so weakly that each impact keeps its own recoil.
/// This gives the times of free flight and of contact with each flank. In flight the load exerts no torque.
/// In contact, or while it bounces faster than the data show, it has the measured motion minus the twist,
/// with friction from the motor's motion: the measured torque, which drives the simulation, must not reappear
/// as its own prediction.
LoadSide load_side(const model::effects::Mechanics& mechanics, const model::effects::EffectChain& chain,
                   const Signals& signals, const Pulls& pulls);

/// Torque that the load exerts, mean around each sample; `friction_Nm` is that of the whole drive with the
/// motor's motion, and `load_Nm` as in Pulls.
std::vector<double> torque_on_motor_Nm(const LoadSide& load, const model::effects::Mechanics& mechanics,
                                       const Signals& signals, std::span<const double> friction_Nm,
                                       std::span<const double> load_Nm);

}  // namespace identification::gap
