/// @file
/// The kinetic friction model: Coulomb, static, Stribeck and viscous friction as one curve.
#pragma once
#include <algorithm>
#include <array>
#include <cmath>

#include "model/friction/parameter_rows.h"
#include "model/friction/stribeck_curve.h"

namespace model::friction {

/// F = s(v)·sgn(v) + σ2·v, s(v) = Fc + (Fs − Fc)·exp(−|v/vs|^δ); at v = 0 the applied torque, up to Fs
///                                                                        [thesis 2.3, figure 9d]
/// Stateless. Rest is an exact zero, as for Coulomb. Where the curve falls faster than σ2 rises, the joint is
/// physically unstable at that speed; the step itself is stable for dt < 2·J/σ2.
class Kfm {
 public:
  static constexpr std::string_view kName = "kfm";
  struct Parameters {                             // defaults: wheel 1 below 1 rad/s, thesis table 4
    double coulomb_Nm = 0.03718;                  ///< Fc
    double static_Nm = 0.08976;                   ///< Fs
    double stribeck_velocity_rad_per_s = 0.1516;  ///< vs
    double stribeck_exponent = 1.047;             ///< δ
    double viscous_Nm_s_per_rad = 0.01898;        ///< σ2
  };
  static constexpr auto kParameters = std::to_array<ParameterInfo<Parameters>>(
      {rows::coulomb<Parameters>(0), rows::static_torque<Parameters>(0),
       rows::stribeck_velocity<Parameters>(), rows::stribeck_exponent<Parameters>(),
       rows::viscous<Parameters>()});

  /// @throws std::invalid_argument as checked()
  explicit Kfm(const Parameters& parameters) : parameters_(checked<Kfm>(parameters)), curve_(parameters) {}
  const Parameters& parameters() const noexcept { return parameters_; }

  double step(State& /*state*/, const Contact& contact, double dt_s) const noexcept {
    if (!usable(contact, dt_s)) return 0.0;
    if (contact.velocity_rad_per_s == 0)
      return std::clamp(contact.applied_torque_Nm, -parameters_.static_Nm, parameters_.static_Nm);
    return steady_Nm(contact.velocity_rad_per_s);
  }
  bool holds(const Contact& contact) const noexcept {
    return contact.velocity_rad_per_s == 0 && std::abs(contact.applied_torque_Nm) <= parameters_.static_Nm;
  }
  double steady_Nm(double velocity_rad_per_s) const noexcept {
    return std::copysign(curve_.level_Nm(velocity_rad_per_s), velocity_rad_per_s) +
           parameters_.viscous_Nm_s_per_rad * velocity_rad_per_s;
  }
  double max_step_s(double inertia_kg_m2) const noexcept {
    return coupled_step_limit_s(0, parameters_.viscous_Nm_s_per_rad, inertia_kg_m2);
  }

 private:
  Parameters parameters_;
  StribeckCurve curve_;
};

}  // namespace model::friction
