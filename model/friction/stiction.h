/// @file
/// Coulomb and viscous friction with a higher breakaway torque.
#pragma once
#include <algorithm>
#include <array>
#include <cmath>

#include "model/friction/parameter_rows.h"

namespace model::friction {

/// F = Fc·sgn(v) + σ2·v; at v = 0 the applied torque, up to Fs [thesis 2.3, figure 9c]
/// Stateless. Rest is an exact zero, as for Coulomb. Stable for dt < 2·J/σ2, with chatter of up to dt·2·Fc/J.
class Stiction {
 public:
  static constexpr std::string_view kName = "stiction";
  struct Parameters {                       // defaults: wheel 1 below 1 rad/s, thesis table 4
    double coulomb_Nm = 0.03718;            ///< Fc
    double static_Nm = 0.08976;             ///< Fs
    double viscous_Nm_s_per_rad = 0.01898;  ///< σ2
  };
  static constexpr auto kParameters = std::to_array<ParameterInfo<Parameters>>(
      {rows::coulomb<Parameters>(0), rows::static_torque<Parameters>(0), rows::viscous<Parameters>()});

  /// @throws std::invalid_argument as checked()
  explicit Stiction(const Parameters& parameters) : parameters_(checked<Stiction>(parameters)) {}
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
    const double level = velocity_rad_per_s == 0 ? parameters_.static_Nm : parameters_.coulomb_Nm;
    return std::copysign(level, velocity_rad_per_s) + parameters_.viscous_Nm_s_per_rad * velocity_rad_per_s;
  }
  double max_step_s(double inertia_kg_m2) const noexcept {
    return coupled_step_limit_s(0, parameters_.viscous_Nm_s_per_rad, inertia_kg_m2);
  }

 private:
  Parameters parameters_;
};

}  // namespace model::friction
