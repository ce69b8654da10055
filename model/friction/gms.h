/// @file
/// The generalised Maxwell-slip law: parallel springs that slip independently.
#pragma once
#include <array>
#include <cmath>

#include "model/friction/maxwell_elements.h"
#include "model/friction/parameter_rows.h"
#include "model/friction/stribeck_curve.h"

namespace model::friction {

/// element i sticks: dFᵢ/dt = kᵢ·v until |Fᵢ| = νᵢ·s(v)
///           slips:   dFᵢ/dt = sgn(v)·Cᵢ·(νᵢ − Fᵢ·sgn(v)/s(v))   until v is zero or reverses
/// F = Σ (Fᵢ + σᵢ·dzᵢ/dt) + σ2·v, Fᵢ = kᵢ·zᵢ, Σ νᵢ = 1
/// [V. Lampaert, F. Al-Bender, J. Swevers 2003; F. Al-Bender, V. Lampaert, J. Swevers, Chaos 14, 2004, with
/// one C and without σᵢ; each element its own: thesis 2.3, whose Cᵢ is Cᵢ·νᵢ/kᵢ in rad/s]
/// A step is exact for constant velocity, including slip within it: νᵢ·s is the equilibrium of a slipping
/// element, so an element that reaches it stays, and a slipping one follows the exponential with time
/// constant s/Cᵢ; dzᵢ/dt is that at its end. Stable coupled to J as coupled_step_limit_s() of Σkᵢ and Σσᵢ +
/// σ2. Closed inner loops, no drift below the first slip. If s depends on speed, the published law is not
/// passive: a slipping element moves from one νᵢ·s(v) to another at the rate Cᵢ and not by the joint's
/// displacement, and a reversal returns the energy that the spring then seems to store. With Fs = Fc it is
/// passive. State: Fᵢ [N·m], which elements slip (a bit each), direction of the last motion.
class Gms {
 public:
  static constexpr std::string_view kName = "gms";
  struct Parameters {             // defaults: wheel 1 below 1 rad/s, thesis table 4 and 2.5.2; C: 50 ms at Fc
    double coulomb_Nm = 0.03718;  ///< Fc
    double static_Nm = 0.08976;   ///< Fs
    double stribeck_velocity_rad_per_s = 0.1516;                                                   ///< vs
    double stribeck_exponent = 1.047;                                                              ///< δ
    double viscous_Nm_s_per_rad = 0.01898;                                                         ///< σ2
    MaxwellElements::Values stiffness_Nm_per_rad = MaxwellElements::kDefaultStiffness_Nm_per_rad;  ///< kᵢ
    MaxwellElements::Values share = MaxwellElements::kDefaultShare;                                ///< νᵢ
    MaxwellElements::Values damping_Nm_s_per_rad{};                                                ///< σᵢ
    MaxwellElements::Values attraction_Nm_per_s{0.75, 0.75, 0.75, 0.75, 0.75,
                                                0.75, 0.75, 0.75, 0.75, 0.75};  ///< Cᵢ
  };
  static constexpr auto kParameters =
      rows::joined(std::to_array<ParameterInfo<Parameters>>(
                       {rows::coulomb<Parameters>(), rows::static_torque<Parameters>(),
                        rows::stribeck_velocity<Parameters>(), rows::stribeck_exponent<Parameters>(),
                        rows::viscous<Parameters>()}),
                   rows::joined(rows::elements<Parameters>(), rows::slip_of_elements<Parameters>()));

  /// @throws std::invalid_argument as checked(), or if no element has a share.
  explicit Gms(const Parameters& parameters);
  const Parameters& parameters() const noexcept { return parameters_; }

  double step(State& state, const Contact& contact, double dt_s) const noexcept;
  double steady_Nm(double velocity_rad_per_s) const noexcept;
  double stored_energy_J(const State& state) const noexcept { return elements_.energy_J(state.x.data()); }
  double max_step_s(double inertia_kg_m2) const noexcept {
    double damping = parameters_.viscous_Nm_s_per_rad;
    for (const double each : damping_Nm_s_per_rad_) damping += each;
    return coupled_step_limit_s(elements_.total_stiffness_Nm_per_rad(), damping, inertia_kg_m2);
  }

 private:
  Parameters parameters_;
  StribeckCurve curve_;
  MaxwellElements elements_;
  MaxwellElements::Values damping_Nm_s_per_rad_;  // of the elements with a share
  MaxwellElements::Values attraction_Nm_per_s_;   // likewise
};

}  // namespace model::friction
