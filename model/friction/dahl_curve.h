/// @file
/// How friction approaches the sliding level after a reversal.
#pragma once
#include <cmath>

namespace model::friction {

/// Dahl's stress-strain curve dF/dx = σ0·(1 − F/Fc)^α along the motion [P. R. Dahl, AIAA J. 14, 1976]
/// Remainder of y = 1 − F/Fc >= 0 after a displacement of k·|Δx| with k = σ0/Fc:
///   y = y₀·(1 − (1 − α)·k·|Δx|·y₀^(α−1))^(1/(1−α)),    α = 1: y = y₀·exp(−k·|Δx|),
/// which for α < 1 reaches zero (F = Fc) after a finite displacement; α = 0 is a straight line until there.
/// Exact for any displacement. Cycle: pure arithmetic.
inline double dahl_remainder(double y, double way, double exponent) noexcept {
  if (y == 0 || way == 0) return y;
  const double beyond = exponent - 1;
  if (beyond == 0) return y * std::exp(-way);
  // The power as exp(−log1p(β·u)/β), which has the exponential as its limit for β = α − 1 towards zero.
  const double u = beyond * way * (beyond == 1 ? y : std::pow(y, beyond));
  return u > -1 ? y * std::exp(-std::log1p(u) / beyond) : 0.0;
}

/// The force after a displacement of `travel`, starting from `force`, towards -`backward` or `forward` (both
/// >= 0). A force above a level that has fallen since decays over the same distance for α = 1, as in LuGre,
/// over a shorter one below that, and at once for α = 0.
inline double dahl_force(double force, double travel, double stiffness, double exponent, double backward,
                         double forward) noexcept {
  const double level = travel > 0 ? forward : backward;
  if (exponent == 0 || !(level > 0)) {
    const double straight = force + stiffness * travel;
    return straight < -backward ? -backward : straight > forward ? forward : straight;
  }
  const double direction = std::copysign(1.0, travel);
  const double way = stiffness * std::abs(travel) / level;
  const double y = 1 - direction * force / level;
  // A sliding joint has already reached it: most samples cost nothing.
  if (std::abs(y) < 1e-6) return direction * level;
  const double left =
      y >= 0 ? dahl_remainder(y, way, exponent) : -dahl_remainder(-y, way / exponent, exponent);
  return direction * level * (1 - left);
}

}  // namespace model::friction
