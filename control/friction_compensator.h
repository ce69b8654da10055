/// @file
/// Adds to a commanded torque what friction will take from it (thesis 2.7.2, figure 27).
#pragma once
#include "control/friction_observer.h"

namespace control {

/// u = c + m·[ |s|·(F̂(v) + T̂(θ)) + s·r(v)·min(F̂_break, |F̂(v)|) ],  s = clamp(c / c_full, −1, 1)
/// with the commanded torque c, the observer's friction F̂, rest share r and torque by position T̂, and the
/// margin m. Between rest and the blend speed friction may have fallen below break-away already: what slides
/// there bounds the help.
/// - Continuous in command and velocity, through zero of either.
/// - At rest it helps break-away in the direction of the command.
/// - It never turns the command round: where it would, u = 0. So what is commanded against a motion brakes
/// it,
///   with all of the friction there is, and without a command friction alone acts, however much too strong or
///   wrong in sign the model is. A good model loses by this only where a command brakes less than friction.
/// - With m at most 1, no blend speed helps by more than the model's friction at the estimated speed. The
///   estimate is the filter's, late by 2ζ/ω: while friction falls with speed the help is that much too large.
/// Cycle: pure.
class FrictionCompensator {
 public:
  struct Config {
    double margin = 0.95;  ///< m, 0 (off) to 1
    double full_command_Nm =
        0.01;  ///< c_full, positive: from this command on friction is compensated in full
  };

  /// @throws std::invalid_argument naming the value out of range.
  explicit FrictionCompensator(const Config& config);

  /// The torque to add to `command_Nm`.
  double torque_Nm(double command_Nm, const FrictionEstimate& estimate,
                   const FrictionObserver& observer) const noexcept;

 private:
  Config config_;
};

}  // namespace control
