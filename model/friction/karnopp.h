/// @file
/// Karnopp's friction: within a small band of velocities the joint counts as at rest.
#pragma once
#include <algorithm>
#include <array>
#include <cmath>

#include "model/friction/kfm.h"
#include "model/friction/parameter_rows.h"

namespace model::friction {

/// |v| < dv: the applied torque, up to Fs; otherwise F_kfm(v)
/// [D. Karnopp, ASME J. Dyn. Syst. Meas. Control 107, 1985; thesis 2.3]
/// Stateless. The second half of the model belongs to the integrator: while holds(), the joint's velocity is
/// zero. An integrator that ignores that still gets zero net torque and coasts at less than dv, where the
/// held torque may act along the motion: the law is passive only with its second half. No chatter as long as
/// one step does not jump over the band, dt < dv·J/Fs; otherwise stable for dt < 2·J/σ2. max_step_s() is the
/// smaller of both.
class Karnopp {
 public:
  static constexpr std::string_view kName = "karnopp";
  struct Parameters {                             // defaults: wheel 1 below 1 rad/s, thesis table 4
    double coulomb_Nm = 0.03718;                  ///< Fc
    double static_Nm = 0.08976;                   ///< Fs
    double stribeck_velocity_rad_per_s = 0.1516;  ///< vs
    double stribeck_exponent = 1.047;             ///< δ
    double viscous_Nm_s_per_rad = 0.01898;        ///< σ2
    double rest_band_rad_per_s = 0.01;            ///< dv
  };
  static constexpr auto kParameters = std::to_array<ParameterInfo<Parameters>>(
      {rows::coulomb<Parameters>(0),
       rows::static_torque<Parameters>(0),
       rows::stribeck_velocity<Parameters>(),
       rows::stribeck_exponent<Parameters>(),
       rows::viscous<Parameters>(),
       {"rest_band_rad_per_s", member<&Parameters::rest_band_rad_per_s>, 1e-9, 1e3}});

  /// @throws std::invalid_argument as checked()
  explicit Karnopp(const Parameters& p)
      : parameters_(checked<Karnopp>(p)),
        kfm_({p.coulomb_Nm, p.static_Nm, p.stribeck_velocity_rad_per_s, p.stribeck_exponent,
              p.viscous_Nm_s_per_rad}) {}
  const Parameters& parameters() const noexcept { return parameters_; }

  double step(State& /*state*/, const Contact& contact, double dt_s) const noexcept {
    if (!usable(contact, dt_s)) return 0.0;
    if (in_band(contact.velocity_rad_per_s))
      return std::clamp(contact.applied_torque_Nm, -parameters_.static_Nm, parameters_.static_Nm);
    return kfm_.steady_Nm(contact.velocity_rad_per_s);
  }
  bool holds(const Contact& contact) const noexcept {
    return in_band(contact.velocity_rad_per_s) &&
           std::abs(contact.applied_torque_Nm) <= parameters_.static_Nm;
  }
  /// The sliding curve down to rest; the band itself has no curve.
  double steady_Nm(double velocity_rad_per_s) const noexcept { return kfm_.steady_Nm(velocity_rad_per_s); }
  double max_step_s(double inertia_kg_m2) const noexcept {
    const double across = parameters_.rest_band_rad_per_s * inertia_kg_m2 / parameters_.static_Nm;
    return std::min(across, kfm_.max_step_s(inertia_kg_m2));
  }

 private:
  bool in_band(double velocity_rad_per_s) const noexcept {
    return std::abs(velocity_rad_per_s) < parameters_.rest_band_rad_per_s;
  }

  Parameters parameters_;
  Kfm kfm_;
};

}  // namespace model::friction
