/// @file
/// One bristle that is held at its reach instead of breaking.
#pragma once
#include <algorithm>
#include <array>
#include <cmath>

#include "model/friction/parameter_rows.h"
#include "model/friction/stribeck_curve.h"

namespace model::friction {

/// dz/dt = v, but 0 while |z| = z0 is pushed outwards; F = (1 + a(z))·σ0(v)·z + σ1·dz/dt,
/// a(z) = a below |z| = z0 and 0 there [Haessig, Friedland 1991; thesis 2.3]
/// σ0(v)·z0 is the sliding friction: Fc·(1 + b·exp(−|v/vs|^δ)) + σ2·|v|, with Fc = σ0·z0 far above vs. While
/// it sticks, σ0 is that of rest, σ0·(1 + b): a spring whose stiffness follows the velocity would return more
/// than it stored.
/// Breakaway at (1 + a)·(1 + b)·Fc. Below it is a damped spring: no drift. The torque jumps from there to the
/// sliding friction when sliding begins and back when it ends, with energy from the spring: passive. Exact
/// for any step: the stuck and the sliding part of the displacement are weighted. Stable as
/// coupled_step_limit_s() of (1 + a)·(1 + b)·σ0 and the larger of σ1 and σ2. State: z [rad].
class ResetIntegrator {
 public:
  static constexpr std::string_view kName = "reset_integrator";
  struct Parameters {                             // defaults: wheel 1, thesis table 4 and 2.5.2
    double coulomb_Nm = 0.03718;                  ///< Fc
    double stiction_gain = 1.414;                 ///< a; with b = 0 Fs/Fc − 1
    double stiffness_Nm_per_rad = 104;            ///< σ0
    double damping_Nm_s_per_rad = 0.127;          ///< σ1
    double stribeck_gain = 0;                     ///< b
    double stribeck_velocity_rad_per_s = 0.1516;  ///< vs
    double stribeck_exponent = 1.047;             ///< δ
    double viscous_Nm_s_per_rad = 0;              ///< σ2
  };
  static constexpr auto kParameters =
      std::to_array<ParameterInfo<Parameters>>({rows::coulomb<Parameters>(),
                                                {"stiction_gain", member<&Parameters::stiction_gain>, 0, 100},
                                                rows::stiffness<Parameters>(),
                                                rows::damping<Parameters>(),
                                                {"stribeck_gain", member<&Parameters::stribeck_gain>, 0, 100},
                                                rows::stribeck_velocity<Parameters>(),
                                                rows::stribeck_exponent<Parameters>(),
                                                rows::viscous<Parameters>()});

  /// @throws std::invalid_argument as checked()
  explicit ResetIntegrator(const Parameters& p)
      : parameters_(checked<ResetIntegrator>(p)),
        reach_rad_(p.coulomb_Nm / p.stiffness_Nm_per_rad),
        stuck_Nm_per_rad_((1 + p.stiction_gain) * (1 + p.stribeck_gain) * p.stiffness_Nm_per_rad) {}
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
    return share * stuck + (1 - share) * std::copysign(sliding_Nm(std::abs(velocity)), z);
  }
  double steady_Nm(double velocity_rad_per_s) const noexcept {
    const double level =
        velocity_rad_per_s == 0 ? stuck_Nm_per_rad_ * reach_rad_ : sliding_Nm(std::abs(velocity_rad_per_s));
    return std::copysign(level, velocity_rad_per_s);
  }
  double stored_energy_J(const State& state) const noexcept {
    return 0.5 * stuck_Nm_per_rad_ * state.x[0] * state.x[0];
  }
  double max_step_s(double inertia_kg_m2) const noexcept {
    return coupled_step_limit_s(stuck_Nm_per_rad_,
                                std::max(parameters_.damping_Nm_s_per_rad, parameters_.viscous_Nm_s_per_rad),
                                inertia_kg_m2);
  }

 private:
  double sliding_Nm(double speed_rad_per_s) const noexcept {  // σ0(v)·z0
    const double peak = parameters_.stribeck_gain == 0
                            ? 0
                            : parameters_.stribeck_gain *
                                  stribeck_share(speed_rad_per_s / parameters_.stribeck_velocity_rad_per_s,
                                                 parameters_.stribeck_exponent);
    return parameters_.coulomb_Nm * (1 + peak) + parameters_.viscous_Nm_s_per_rad * speed_rad_per_s;
  }

  Parameters parameters_;
  double reach_rad_;         // z0
  double stuck_Nm_per_rad_;  // (1 + a)·(1 + b)·σ0
};

}  // namespace model::friction
