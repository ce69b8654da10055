/// @file
/// Coulomb's friction: one level, against the motion.
#pragma once
#include <algorithm>
#include <array>
#include <cmath>

#include "model/friction/parameter_rows.h"

namespace model::friction {

/// F = Fc·sgn(v); at v = 0 the applied torque, up to Fc [thesis figure 9a]
/// Stateless. Only an exact zero is rest: an integrated joint chatters by up to dt·2·Fc/J about rest, which
/// the laws with a threshold, a dead zone or a spring avoid. Any step is stable in that sense.
class Coulomb {
 public:
  static constexpr std::string_view kName = "coulomb";
  struct Parameters {
    double coulomb_Nm = 0.03718;  ///< Fc; default: wheel 1 below 1 rad/s, thesis table 4
  };
  static constexpr auto kParameters =
      std::to_array<ParameterInfo<Parameters>>({rows::coulomb<Parameters>(0)});

  /// @throws std::invalid_argument as checked()
  explicit Coulomb(const Parameters& parameters) : parameters_(checked<Coulomb>(parameters)) {}
  const Parameters& parameters() const noexcept { return parameters_; }

  double step(State& /*state*/, const Contact& contact, double dt_s) const noexcept {
    if (!usable(contact, dt_s)) return 0.0;
    const double level = parameters_.coulomb_Nm;
    if (contact.velocity_rad_per_s == 0) return std::clamp(contact.applied_torque_Nm, -level, level);
    return std::copysign(level, contact.velocity_rad_per_s);
  }
  bool holds(const Contact& contact) const noexcept {
    return contact.velocity_rad_per_s == 0 && std::abs(contact.applied_torque_Nm) <= parameters_.coulomb_Nm;
  }
  double steady_Nm(double velocity_rad_per_s) const noexcept {
    return std::copysign(parameters_.coulomb_Nm, velocity_rad_per_s);
  }
  double max_step_s(double inertia_kg_m2) const noexcept { return coupled_step_limit_s(0, 0, inertia_kg_m2); }

 private:
  Parameters parameters_;
};

}  // namespace model::friction
