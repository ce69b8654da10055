/// @file
/// Viscous friction: proportional to the velocity.
#pragma once
#include <array>

#include "model/friction/parameter_rows.h"

namespace model::friction {

/// F = σ2·v. Stateless; coupled to an inertia, stable for dt < 2·J/σ2.
class Viscous {
 public:
  static constexpr std::string_view kName = "viscous";
  struct Parameters {
    double viscous_Nm_s_per_rad = 0.01898;  ///< σ2; default: wheel 1, thesis table 4
  };
  static constexpr auto kParameters = std::to_array<ParameterInfo<Parameters>>({rows::viscous<Parameters>()});

  /// @throws std::invalid_argument as checked()
  explicit Viscous(const Parameters& parameters) : parameters_(checked<Viscous>(parameters)) {}
  const Parameters& parameters() const noexcept { return parameters_; }

  double step(State& /*state*/, const Contact& contact, double dt_s) const noexcept {
    return usable(contact, dt_s) ? steady_Nm(contact.velocity_rad_per_s) : 0.0;
  }
  double steady_Nm(double velocity_rad_per_s) const noexcept {
    return parameters_.viscous_Nm_s_per_rad * velocity_rad_per_s;
  }
  double max_step_s(double inertia_kg_m2) const noexcept {
    return coupled_step_limit_s(0, parameters_.viscous_Nm_s_per_rad, inertia_kg_m2);
  }

 private:
  Parameters parameters_;
};

}  // namespace model::friction
