/// @file
/// The element that sticks: an elastic deflection that gives way at a bound.
#pragma once
#include <algorithm>

namespace sim {

/// F = clamp(σ0·z + σ1·v, −b₋, b₊),  dz/dt = v while −b₋ < σ0·z < b₊.
/// One Maxwell-slip element with a bound that may change from step to step: below the bound a damped spring,
/// so a joint at rest really rests (no creep, no drift under load below break-away); sliding, exactly the
/// bound. It serves as pre-sliding of a joint (rad, N·m) and as grip of a roller on the floor (m, N).
/// One step is exact in z for a constant velocity, whatever the step size. Cycle: pure arithmetic.
class BoundedBristle {
 public:
  struct Parameters {
    double stiffness = 1.0;  ///< σ0, force per displacement
    double damping = 0.0;    ///< σ1, force per velocity, while it sticks
  };
  explicit BoundedBristle(const Parameters& parameters) noexcept : parameters_(parameters) {}

  /// The force against the motion over a step of length `step_s` at `velocity`, between -`backward` and
  /// `forward` (both >= 0). Which bound counts is decided by the deflection and not by the velocity: a loaded
  /// joint that rings while it sticks is still held by the break-away of the direction it is pushed to.
  double step(double velocity, double forward, double backward, double step_s) noexcept {
    deflection_ = std::clamp(deflection_ + velocity * step_s, -backward / parameters_.stiffness,
                             forward / parameters_.stiffness);
    return std::clamp(parameters_.stiffness * deflection_ + parameters_.damping * velocity, -backward,
                      forward);
  }
  double step(double velocity, double bound, double step_s) noexcept {
    return step(velocity, bound, bound, step_s);
  }
  double deflection() const noexcept { return deflection_; }

 private:
  Parameters parameters_;
  double deflection_ = 0.0;
};

}  // namespace sim
