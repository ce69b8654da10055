/// @file
/// LuGre without slip below a breakaway deflection.
#pragma once
#include <array>

#include "model/friction/parameter_rows.h"
#include "model/friction/stribeck_curve.h"

namespace model::friction {

/// dz/dt = v·(1 − α(z, v)·sgn(v)·z/z_ss(v)), F = σ0·z + σ1·dz/dt + σ2·v, z_ss = s(v)/σ0
/// α = 0 while z is unloaded or |z| <= z_ba, 1 from z_ss on, between them ½ + ½·sin(π·(|z| − (z_ba +
/// z_ss)/2)/(z_ss − z_ba))
/// [P. Dupont, V. Hayward, B. Armstrong, F. Altpeter, IEEE TAC 47(5), 2002]
/// z_ba is a share of the smallest z_ss, so that 0 < z_ba < z_ss(v) holds at every speed. Loads within
/// ±σ0·z_ba cause no permanent displacement, even if they oscillate: the contact is a spring there. Between
/// that and breakaway it creeps, as LuGre does everywhere.
/// A step is exact in the elastic range and where α = 1; in the transition it is an exponential Rosenbrock
/// step of second order, split in at most two, and never passes z_ss. Stability coupled to J, and passivity
/// in z, as for LuGre.
/// State: z [rad].
class ElastoPlastic {
 public:
  static constexpr std::string_view kName = "elasto_plastic";
  struct Parameters {  // defaults: wheel 1 below 1 rad/s, thesis table 4 and 2.5.2; the share is a usual one
    double coulomb_Nm = 0.03718;                  ///< Fc
    double static_Nm = 0.08976;                   ///< Fs
    double stribeck_velocity_rad_per_s = 0.1516;  ///< vs
    double stribeck_exponent = 1.047;             ///< δ
    double stiffness_Nm_per_rad = 250;            ///< σ0
    double damping_Nm_s_per_rad = 0.127;          ///< σ1
    double viscous_Nm_s_per_rad = 0.01898;        ///< σ2
    double breakaway_share = 0.8;                 ///< σ0·z_ba/min(Fc, Fs)
  };
  static constexpr auto kParameters = std::to_array<ParameterInfo<Parameters>>(
      {rows::coulomb<Parameters>(),
       rows::static_torque<Parameters>(),
       rows::stribeck_velocity<Parameters>(),
       rows::stribeck_exponent<Parameters>(),
       rows::stiffness<Parameters>(),
       rows::damping<Parameters>(),
       rows::viscous<Parameters>(),
       {"breakaway_share", member<&Parameters::breakaway_share>, 0.01, 0.99}});

  /// @throws std::invalid_argument as checked()
  explicit ElastoPlastic(const Parameters& parameters);
  const Parameters& parameters() const noexcept { return parameters_; }

  double step(State& state, const Contact& contact, double dt_s) const noexcept;
  double steady_Nm(double velocity_rad_per_s) const noexcept;
  double stored_energy_J(const State& state) const noexcept {
    return 0.5 * parameters_.stiffness_Nm_per_rad * state.x[0] * state.x[0];
  }
  double max_step_s(double inertia_kg_m2) const noexcept {
    return coupled_step_limit_s(parameters_.stiffness_Nm_per_rad,
                                parameters_.damping_Nm_s_per_rad + parameters_.viscous_Nm_s_per_rad,
                                inertia_kg_m2);
  }

 private:
  Parameters parameters_;
  StribeckCurve curve_;
  double breakaway_rad_;  // z_ba
};

}  // namespace model::friction
