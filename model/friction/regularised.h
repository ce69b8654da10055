/// @file
/// The kinetic friction model with a steep line through zero instead of its jump.
#pragma once
#include <array>
#include <cmath>

#include "model/friction/kfm.h"
#include "model/friction/parameter_rows.h"

namespace model::friction {

/// F = F_kfm(v) for |v| >= ε, F_kfm(ε)·v/ε below [thesis 2.3, figure 10]
/// Stateless and continuous. It cannot stick: under a constant load τ below F_kfm(ε) the joint creeps at v =
/// ε·τ/F_kfm(ε). A small ε requires a small step: stable for dt < 2·J·ε/F_kfm(ε).
class Regularised {
 public:
  static constexpr std::string_view kName = "regularised";
  struct Parameters {                             // defaults: wheel 1 below 1 rad/s, thesis table 4
    double coulomb_Nm = 0.03718;                  ///< Fc
    double static_Nm = 0.08976;                   ///< Fs
    double stribeck_velocity_rad_per_s = 0.1516;  ///< vs
    double stribeck_exponent = 1.047;             ///< δ
    double viscous_Nm_s_per_rad = 0.01898;        ///< σ2
    double threshold_rad_per_s = 0.005;           ///< ε
  };
  static constexpr auto kParameters = std::to_array<ParameterInfo<Parameters>>(
      {rows::coulomb<Parameters>(0),
       rows::static_torque<Parameters>(0),
       rows::stribeck_velocity<Parameters>(),
       rows::stribeck_exponent<Parameters>(),
       rows::viscous<Parameters>(),
       {"threshold_rad_per_s", member<&Parameters::threshold_rad_per_s>, 1e-9, 1e3}});

  /// @throws std::invalid_argument as checked()
  explicit Regularised(const Parameters& p)
      : parameters_(checked<Regularised>(p)),
        kfm_({p.coulomb_Nm, p.static_Nm, p.stribeck_velocity_rad_per_s, p.stribeck_exponent,
              p.viscous_Nm_s_per_rad}),
        slope_Nm_s_per_rad_(kfm_.steady_Nm(p.threshold_rad_per_s) / p.threshold_rad_per_s) {}
  const Parameters& parameters() const noexcept { return parameters_; }

  double step(State& /*state*/, const Contact& contact, double dt_s) const noexcept {
    return usable(contact, dt_s) ? steady_Nm(contact.velocity_rad_per_s) : 0.0;
  }
  double steady_Nm(double velocity_rad_per_s) const noexcept {
    return std::abs(velocity_rad_per_s) < parameters_.threshold_rad_per_s
               ? slope_Nm_s_per_rad_ * velocity_rad_per_s
               : kfm_.steady_Nm(velocity_rad_per_s);
  }
  double max_step_s(double inertia_kg_m2) const noexcept {
    return coupled_step_limit_s(0, slope_Nm_s_per_rad_, inertia_kg_m2);
  }

 private:
  Parameters parameters_;
  Kfm kfm_;
  double slope_Nm_s_per_rad_;  // F_kfm(ε)/ε, which is above σ2
};

}  // namespace model::friction
