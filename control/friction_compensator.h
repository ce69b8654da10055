/// @file
/// Adds the friction expected by the model to a commanded torque (thesis 2.7.2, figure 27).
#pragma once
#include "control/friction_observer.h"

namespace control {

/// u = c + m·[ |s|·(k·F̂(v) + T̂(θ)) + s·r(v)·k·min(F̂_break, |F̂(v)|) ], s = clamp(c / c_full, −1, 1)
/// with the commanded torque c, the observer's friction F̂, its factor k, rest share r, position-dependent
/// torque T̂ and margin m. Between rest and the blend speed, friction may already be below breakaway, so
/// sliding friction bounds the compensation.
/// - Continuous in command and velocity, through zero of either.
/// - At rest it helps breakaway in the direction of the command.
/// - It never reverses the command: where it would, u = 0. A command against the motion therefore brakes with
///   at least the full friction, and without a command only friction acts, however much the model
///   overestimates friction or even if its sign is wrong. A good model loses by this only where a command
///   brakes less than friction.
/// - With m at most 1, it never adds more than k times the model's friction at the estimated speed. The
/// filter delays
///   the estimate by 2ζ/ω; while friction falls with speed, the compensation is too large by that delay.
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

  /// Torque to add to `command_Nm`. `factor`: k, see FrictionAdaptation.
  double torque_Nm(double command_Nm, const FrictionEstimate& estimate, const FrictionObserver& observer,
                   double factor = 1) const noexcept;

 private:
  Config config_;
};

}  // namespace control
