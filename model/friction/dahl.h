/// @file
/// Dahl's friction: a stress-strain curve in place of Coulomb's jump.
#pragma once
#include <algorithm>
#include <array>
#include <cmath>

#include "model/friction/dahl_curve.h"
#include "model/friction/parameter_rows.h"

namespace model::friction {

/// dF/dx = σ0·|1 − F/Fc·sgn(v)|^α·sgn(1 − F/Fc·sgn(v)) [P. R. Dahl, AIAA J. 14, 1976; thesis 2.3]
/// It depends on displacement and not on speed, so any step is exact (dahl_remainder()); coupled to an
/// inertia, stable for dt < 2·√(J/(2^α·σ0)), where 2^α·σ0 is the slope right after a reversal. No stiction or
/// Stribeck effect. Like all laws whose deflection slips slightly at any load (α > 0) it drifts under an
/// oscillating load. State: F [N·m].
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
    const double y = dahl_remainder(std::max(0.0, 1 - direction * state.x[0] / parameters_.coulomb_Nm), way,
                                    parameters_.exponent);
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
  Parameters parameters_;
};

}  // namespace model::friction
