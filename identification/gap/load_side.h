/// @file
/// What a load behind a gap or a spring asks of the motor whose motion was measured.
#pragma once
#include <span>
#include <vector>

#include "identification/gap/signals.h"
#include "model/effects/effect.h"
#include "model/effects/effect_chain.h"

namespace identification::gap {

/// What works on a drive besides inertia and friction, at each sample.
struct Pulls {
  std::span<const double> drive_Nm;  ///< that the actuator delivers
  std::span<const double> motor_Nm;  ///< against positive motion of the motor
  std::span<const double> load_Nm;   ///< against that of the load
};

/// At each sample.
struct LoadSide {
  std::vector<double>
      simulated_Nm;               ///< torque on the motor, mean around the sample, but for what `lies` adds
  std::vector<double> lies;       ///< 1 where the load goes with the measured motor, 0 where it does not
  std::vector<double> twist_rad;  ///< by how much the motor is ahead of the load
  std::vector<double> velocity_rad_per_s;
};

/// The load of `mechanics`, simulated, for the motion of the motor alone does not show how it coasts through
/// a gap and rings on a spring.
///
/// Behind a spring it follows the measured motor. On the flanks of a gap it bounces, and the motor recoils:
/// both move as the torque drives them, drawn to where the motor was measured so weakly that it answers each
/// blow by itself. That tells when the load flies and when it lies on which flank. In flight it asks for
/// nothing. Where it lies, or bounces faster than the data show, it has the measured motion less the twist
/// and rubs as the motor moves: the torque that was measured, which drives the simulation, must not come back
/// as its own prediction.
LoadSide load_side(const model::effects::Mechanics& mechanics, const model::effects::EffectChain& chain,
                   const Signals& signals, const Pulls& pulls);

/// What the load asks for, mean around each sample; `friction_Nm` is that of all the drive, as the motor
/// moves, and `load_Nm` as in Pulls.
std::vector<double> torque_on_motor_Nm(const LoadSide& load, const model::effects::Mechanics& mechanics,
                                       const Signals& signals, std::span<const double> friction_Nm,
                                       std::span<const double> load_Nm);

}  // namespace identification::gap
