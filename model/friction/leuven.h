/// @file
/// The Leuven law: LuGre's equation on a spring with memory.
#pragma once
#include <array>

#include "model/friction/maxwell_elements.h"
#include "model/friction/parameter_rows.h"
#include "model/friction/stribeck_curve.h"

namespace model::friction {

/// dz/dt = v·(1 − sgn(q)·|q|ⁿ), q = F_h(z)/s(v)·sgn(v); F = F_h(z) + σ1·dz/dt + σ2·v
/// F_h = Σ Fᵢ: Maxwell-slip elements over z, |Fᵢ| <= νᵢ·max(Fc, Fs), dFᵢ/dz = kᵢ below
/// [J. Swevers, F. Al-Bender, C. Ganseman, T. Prajogo, IEEE TAC 45(4), 2000; with the sliders V. Lampaert, J.
/// Swevers, F. Al-Bender, IEEE TAC 47(4), 2002; thesis 2.3]
/// Together the sliders carry the maximum sliding torque, so that F_h reaches s(v) at every speed. A step is
/// split where a slider starts to slip; in between, it is exact for n = 1 and an exponential Rosenbrock step
/// of second order for other n; F_h never passes s(v). Stable coupled to J as coupled_step_limit_s() of Σkᵢ
/// and σ1 + σ2. Passive in F_h; inner loops close where z follows the joint, that is for |q|ⁿ near 0.
/// State: Fᵢ [N·m].
class Leuven {
 public:
  static constexpr std::string_view kName = "leuven";
  struct Parameters {                             // defaults: wheel 1 below 1 rad/s, thesis table 4 and 2.5.2
    double coulomb_Nm = 0.03718;                  ///< Fc
    double static_Nm = 0.08976;                   ///< Fs
    double stribeck_velocity_rad_per_s = 0.1516;  ///< vs
    double stribeck_exponent = 1.047;             ///< δ
    double transition_exponent = 2;               ///< n
    double damping_Nm_s_per_rad = 0.127;          ///< σ1
    double viscous_Nm_s_per_rad = 0.01898;        ///< σ2
    MaxwellElements::Values stiffness_Nm_per_rad = MaxwellElements::kDefaultStiffness_Nm_per_rad;  ///< kᵢ
    MaxwellElements::Values share = MaxwellElements::kDefaultShare;                                ///< νᵢ
  };
  static constexpr auto kParameters =
      rows::joined(std::to_array<ParameterInfo<Parameters>>(
                       {rows::coulomb<Parameters>(),
                        rows::static_torque<Parameters>(),
                        rows::stribeck_velocity<Parameters>(),
                        rows::stribeck_exponent<Parameters>(),
                        {"transition_exponent", member<&Parameters::transition_exponent>, 1, 50},
                        rows::damping<Parameters>(),
                        rows::viscous<Parameters>()}),
                   rows::elements<Parameters>());

  /// @throws std::invalid_argument as checked(), or if no element has a share.
  explicit Leuven(const Parameters& parameters);
  const Parameters& parameters() const noexcept { return parameters_; }

  double step(State& state, const Contact& contact, double dt_s) const noexcept;
  double steady_Nm(double velocity_rad_per_s) const noexcept;
  double stored_energy_J(const State& state) const noexcept { return elements_.energy_J(state.x.data()); }
  double max_step_s(double inertia_kg_m2) const noexcept {
    return coupled_step_limit_s(elements_.total_stiffness_Nm_per_rad(),
                                parameters_.damping_Nm_s_per_rad + parameters_.viscous_Nm_s_per_rad,
                                inertia_kg_m2);
  }

 private:
  struct Rate {
    double value;         // dz/dx along the motion
    double slope_per_Nm;  // its derivative with respect to F_h, never positive
  };
  Rate rate_at(double hysteresis_Nm, double level_Nm) const noexcept;

  Parameters parameters_;
  StribeckCurve curve_;
  MaxwellElements elements_;
};

}  // namespace model::friction
