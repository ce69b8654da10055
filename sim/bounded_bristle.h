/// @file
/// The element that sticks: an elastic deflection that gives way at a bound.
#pragma once
#include <algorithm>

namespace sim {

/// F = clamp(σ0·z + σ1·v, ±bound),  dz/dt = v while |z| < bound/σ0.
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

  /// The force against the motion over a step of length `step_s` at `velocity`, with the given `bound` >= 0.
  double step(double velocity, double bound, double step_s) noexcept {
    const double limit = bound / parameters_.stiffness;
    deflection_ = std::clamp(deflection_ + velocity * step_s, -limit, limit);
    return std::clamp(parameters_.stiffness * deflection_ + parameters_.damping * velocity, -bound, bound);
  }
  double deflection() const noexcept { return deflection_; }

 private:
  Parameters parameters_;
  double deflection_ = 0.0;
};

}  // namespace sim
