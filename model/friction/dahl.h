/// @file
/// Dahl's friction: a stress-strain curve in place of Coulomb's jump.
#pragma once
#include <algorithm>
#include <array>
#include <cmath>

#include "model/friction/parameter_rows.h"

namespace model::friction {

/// dF/dx = σ0·|1 − F/Fc·sgn(v)|^α·sgn(1 − F/Fc·sgn(v))      [P. R. Dahl, AIAA J. 14, 1976; thesis 2.3]
/// With y = 1 − F/Fc·sgn(v) and k = σ0/Fc a step of travel |Δx| has the closed form
///   y = y₀·(1 − (1 − α)·k·|Δx|·y₀^(α−1))^(1/(1−α)),    α = 1: y = y₀·exp(−k·|Δx|),
/// which for α < 1 reaches zero (F = Fc) after a finite way. It depends on the way and not on the speed, so
/// any step is exact; coupled to an inertia, stable for dt < 2·√(J/(2^α·σ0)), where 2^α·σ0 is the slope
/// right after a reversal. Neither stiction nor Stribeck effect, and like all laws whose deflection slips a
/// little at any load (α > 0) it drifts under a load that swings.
/// State: F [N·m].
class Dahl {
 public:
  static constexpr std::string_view kName = "dahl";
  struct Parameters {                   // defaults: wheel 1, thesis table 4 and 2.5.2
    double coulomb_Nm = 0.03718;        ///< Fc
    double stiffness_Nm_per_rad = 250;  ///< σ0, slope at F = 0
    double exponent = 1;                ///< α
  };
  static constexpr auto kParameters =
      std::to_array<ParameterInfo<Parameters>>({rows::coulomb<Parameters>(),
                                                rows::stiffness<Parameters>(),
                                                {"exponent", member<&Parameters::exponent>, 0, 5}});

  /// @throws std::invalid_argument as checked()
  explicit Dahl(const Parameters& parameters) : parameters_(checked<Dahl>(parameters)) {}
  const Parameters& parameters() const noexcept { return parameters_; }

  double step(State& state, const Contact& contact, double dt_s) const noexcept {
    if (!usable(contact, dt_s)) return 0.0;
    const double direction = std::copysign(1.0, contact.velocity_rad_per_s);
    const double way = std::abs(contact.velocity_rad_per_s) * dt_s * parameters_.stiffness_Nm_per_rad /
                       parameters_.coulomb_Nm;
    const double y = remainder(std::max(0.0, 1 - direction * state.x[0] / parameters_.coulomb_Nm), way);
    return state.x[0] = direction * parameters_.coulomb_Nm * (1 - y);
  }
  double steady_Nm(double velocity_rad_per_s) const noexcept {
    return std::copysign(parameters_.coulomb_Nm, velocity_rad_per_s);
  }
  double stored_energy_J(const State& state) const noexcept {
    return 0.5 * state.x[0] * state.x[0] / parameters_.stiffness_Nm_per_rad;
  }
  double max_step_s(double inertia_kg_m2) const noexcept {
    return coupled_step_limit_s(std::exp2(parameters_.exponent) * parameters_.stiffness_Nm_per_rad, 0,
                                inertia_kg_m2);
  }

 private:
  /// y after the way k·|Δx|, from y >= 0.
  double remainder(double y, double way) const noexcept {
    if (y == 0 || way == 0) return y;
    const double beyond = parameters_.exponent - 1;
    if (beyond == 0) return y * std::exp(-way);
    // The power as exp(−log1p(β·u)/β), which has the exponential as its limit for β = α − 1 towards zero.
    const double u = beyond * way * (beyond == 1 ? y : std::pow(y, beyond));
    return u > -1 ? y * std::exp(-std::log1p(u) / beyond) : 0.0;
  }

  Parameters parameters_;
};

}  // namespace model::friction
