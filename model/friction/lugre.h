/// @file
/// The LuGre law: the mean deflection of many bristles.
#pragma once
#include <array>
#include <cmath>

#include "model/friction/parameter_rows.h"
#include "model/friction/stribeck_curve.h"

namespace model::friction {

/// dz/dt = v − σ0·|v|/s(v)·z, F = σ0·z + σ1·dz/dt + σ2·v, s(v) as in StribeckCurve
/// [C. Canudas de Wit, H. Olsson, K. J. Åström, P. Lischinsky, IEEE TAC 40(3), 1995; thesis 2.3, 2.4.1]
/// At constant v, z goes to z_ss = sgn(v)·s/σ0, exactly as
///   z(t) = z_ss + (z₀ − z_ss)·exp(−σ0·|v|·t/s),
/// and so does a step: no step is too long for the state, whereas explicit Euler needs dt < 2·s/(σ0·|v|), for
/// wheel 1 5 ms at 0.1 rad/s and 0.03 ms at 10. Coupled to J the limit is that of the stuck joint,
/// coupled_step_limit_s() of σ0 and σ1 + σ2.
/// z is passive: σ0·z²/2 never exceeds the energy that v·σ0·z supplied. The whole of F is passive for any
/// motion only where |v|/s(v) <= 4·(σ1 + σ2)/σ1², for wheel 1 up to 1.3 rad/s: above, a sudden change of
/// velocity may extract a little energy from the damper.
/// Known defects: z slips slightly at any load, so the joint drifts under a load that oscillates about a
/// bias; no memory of inner loops.
/// State: z [rad].
class LuGre {
 public:
  static constexpr std::string_view kName = "lugre";
  struct Parameters {                             // defaults: wheel 1 below 1 rad/s, thesis table 4 and 2.5.2
    double coulomb_Nm = 0.03718;                  ///< Fc
    double static_Nm = 0.08976;                   ///< Fs
    double stribeck_velocity_rad_per_s = 0.1516;  ///< vs
    double stribeck_exponent = 1.047;             ///< δ
    double stiffness_Nm_per_rad = 250;            ///< σ0
    double damping_Nm_s_per_rad = 0.127;          ///< σ1
    double viscous_Nm_s_per_rad = 0.01898;        ///< σ2
  };
  static constexpr auto kParameters = std::to_array<ParameterInfo<Parameters>>(
      {rows::coulomb<Parameters>(), rows::static_torque<Parameters>(), rows::stribeck_velocity<Parameters>(),
       rows::stribeck_exponent<Parameters>(), rows::stiffness<Parameters>(), rows::damping<Parameters>(),
       rows::viscous<Parameters>()});

  /// @throws std::invalid_argument as checked()
  explicit LuGre(const Parameters& parameters)
      : parameters_(checked<LuGre>(parameters)), curve_(parameters) {}
  const Parameters& parameters() const noexcept { return parameters_; }

  double step(State& state, const Contact& contact, double dt_s) const noexcept {
    if (!usable(contact, dt_s)) return 0.0;
    const double velocity = contact.velocity_rad_per_s;
    const double speed = std::abs(velocity);
    const double slope = parameters_.stiffness_Nm_per_rad;
    const double reach = curve_.level_Nm(speed) / slope;
    const double rate = speed / reach;
    const double steady = std::copysign(reach, velocity);
    const double off = (state.x[0] - steady) * std::exp(-rate * dt_s);  // which decays: dz/dt = −rate·off
    if (rate != 0) state.x[0] = steady + off;
    return slope * state.x[0] - parameters_.damping_Nm_s_per_rad * rate * off +
           parameters_.viscous_Nm_s_per_rad * velocity;
  }
  double steady_Nm(double velocity_rad_per_s) const noexcept {
    return std::copysign(curve_.level_Nm(velocity_rad_per_s), velocity_rad_per_s) +
           parameters_.viscous_Nm_s_per_rad * velocity_rad_per_s;
  }
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
};

}  // namespace model::friction
