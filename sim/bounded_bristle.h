/// @file
/// An element that sticks: an elastic deflection that slips at a bound.
#pragma once
#include <algorithm>
#include <cmath>
#include <concepts>
#include <utility>

#include "model/friction/dahl_curve.h"

namespace sim {

/// F = clamp(σ0·z + σ1·v, −b₋, b₊), dz/dt = v while −b₋ < σ0·z < b₊; with an exponent α the deflection
/// approaches its bound as Dahl's does, the damping acts on dz/dt, and it slips slightly at any load. Without
/// one it is a Maxwell-slip element with a bound that may change from step to step: below the bound a damped
/// spring, so a joint at rest really rests (no creep, no drift under load below breakaway); sliding, exactly
/// the bound. As α goes to zero the damping still acts on dz/dt, unbounded. Used for presliding of a joint
/// (rad, N·m) and grip of a roller on the floor (m, N). A step is exact in z for a constant velocity,
/// whatever the step size. Cycle: pure arithmetic.
class BoundedBristle {
 public:
  struct Parameters {
    double stiffness = 1.0;  ///< σ0, force per displacement
    double damping = 0.0;    ///< σ1, force per velocity, while it sticks
    double exponent = 0.0;   ///< α
  };
  explicit BoundedBristle(const Parameters& parameters) noexcept : parameters_(parameters) {}

  /// The force against the motion over a step of length `step_s` at `velocity`, between -`bound(-1)` and
  /// `bound(+1)` (both >= 0). The deflection, not the velocity, selects the bound: a loaded joint that rings
  /// while it sticks is still held by the breakaway of the direction in which it is pushed. With an exponent
  /// it is the bound of the motion, and damping is added. Only the bounds needed are evaluated. `step_s` > 0.
  template <std::invocable<double> Bound>
  double step(double velocity, const Bound& bound, double step_s) noexcept {
    if (parameters_.exponent > 0) return bend(velocity, bound(std::copysign(1.0, velocity)), step_s);
    const double reached = deflection_ + velocity * step_s;
    if (std::signbit(reached)) return push<-1>(velocity, reached, bound);
    return push<1>(velocity, reached, bound);
  }
  double step(double velocity, double bound, double step_s) noexcept {
    return step(
        velocity, [bound](double) { return bound; }, step_s);
  }
  double deflection() const noexcept { return deflection_; }
  void set_deflection(double deflection) noexcept { deflection_ = deflection; }

 private:
  /// Direction as a template argument and bound as a branch: the processor predicts both and continues during
  /// the division.
  template <int kDirection, std::invocable<double> Bound>
  double push(double velocity, double reached, const Bound& bound) noexcept {
    const double level = bound(double{kDirection});
    deflection_ = kDirection * std::min(kDirection * reached, level / parameters_.stiffness);
    const double force = parameters_.stiffness * deflection_ + parameters_.damping * velocity;
    if (level < kDirection * force) return kDirection * level;
    if (kDirection * force >= 0) return force;
    // Damping may act in the other direction.
    return -kDirection * std::min(-kDirection * force, bound(double{-kDirection}));
  }

  double bend(double velocity, double level, double step_s) noexcept {
    const double before = std::exchange(
        deflection_, model::friction::dahl_force(parameters_.stiffness * deflection_, velocity * step_s,
                                                 parameters_.stiffness, parameters_.exponent, level, level) /
                         parameters_.stiffness);
    return parameters_.stiffness * deflection_ + parameters_.damping * (deflection_ - before) / step_s;
  }

  Parameters parameters_;
  double deflection_ = 0.0;
};

}  // namespace sim
