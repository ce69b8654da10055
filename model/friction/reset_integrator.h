/// @file
/// One bristle that is held at its reach instead of breaking.
#pragma once
#include <algorithm>
#include <array>
#include <cmath>

#include "model/friction/parameter_rows.h"

namespace model::friction {

/// dz/dt = v, but 0 while |z| = z0 is pushed outwards; F = (1 + a(z))·σ0·z + σ1·dz/dt,
/// a(z) = a below |z| = z0 and 0 there [Haessig, Friedland 1991; thesis 2.3], with Fc = σ0·z0.
/// Breakaway at (1 + a)·Fc, sliding at Fc. Below breakaway it is a damped spring: no drift. The torque jumps
/// by a·Fc when sliding begins and again when it ends, with energy from the spring (1 + a)·σ0: passive. Exact
/// for any step: the stuck and the sliding part of the displacement are weighted. Stable as
/// coupled_step_limit_s() of (1 + a)·σ0 and σ1.
/// State: z [rad].
class ResetIntegrator {
 public:
  static constexpr std::string_view kName = "reset_integrator";
  struct Parameters {                     // defaults: wheel 1, thesis table 4 and 2.5.2
    double coulomb_Nm = 0.03718;          ///< Fc
    double stiction_gain = 1.414;         ///< a = Fs/Fc − 1
    double stiffness_Nm_per_rad = 104;    ///< σ0: a stuck joint has the stiffness (1 + a)·σ0
    double damping_Nm_s_per_rad = 0.127;  ///< σ1
  };
  static constexpr auto kParameters =
      std::to_array<ParameterInfo<Parameters>>({rows::coulomb<Parameters>(),
                                                {"stiction_gain", member<&Parameters::stiction_gain>, 0, 100},
                                                rows::stiffness<Parameters>(),
                                                rows::damping<Parameters>()});

  /// @throws std::invalid_argument as checked()
  explicit ResetIntegrator(const Parameters& p)
      : parameters_(checked<ResetIntegrator>(p)),
        reach_rad_(p.coulomb_Nm / p.stiffness_Nm_per_rad),
        stuck_Nm_per_rad_((1 + p.stiction_gain) * p.stiffness_Nm_per_rad) {}
  const Parameters& parameters() const noexcept { return parameters_; }

  double step(State& state, const Contact& contact, double dt_s) const noexcept {
    if (!usable(contact, dt_s)) return 0.0;
    double& z = state.x[0];
    const double velocity = contact.velocity_rad_per_s;
    const double way = velocity * dt_s;
    const double before = z;
    z = std::clamp(z + way, -reach_rad_, reach_rad_);
    // The share of the step's displacement on which the bond slips.
    double share = 1.0;
    if (std::abs(z) == reach_rad_) share = way == 0 ? 0.0 : std::clamp((z - before) / way, 0.0, 1.0);
    const double stuck = stuck_Nm_per_rad_ * z + parameters_.damping_Nm_s_per_rad * velocity;
    return share * stuck + (1 - share) * parameters_.stiffness_Nm_per_rad * z;
  }
  double steady_Nm(double velocity_rad_per_s) const noexcept {
    const double level = velocity_rad_per_s == 0 ? stuck_Nm_per_rad_ * reach_rad_ : parameters_.coulomb_Nm;
    return std::copysign(level, velocity_rad_per_s);
  }
  double stored_energy_J(const State& state) const noexcept {
    return 0.5 * stuck_Nm_per_rad_ * state.x[0] * state.x[0];
  }
  double max_step_s(double inertia_kg_m2) const noexcept {
    return coupled_step_limit_s(stuck_Nm_per_rad_, parameters_.damping_Nm_s_per_rad, inertia_kg_m2);
  }

 private:
  Parameters parameters_;
  double reach_rad_;         // z0
  double stuck_Nm_per_rad_;  // (1 + a)·σ0
};

}  // namespace model::friction
