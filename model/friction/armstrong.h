/// @file
/// Armstrong's seven-parameter friction: a spring at rest, and sliding with memory.
#pragma once
#include <array>

#include "model/friction/parameter_rows.h"

namespace model::friction {

/// sticking: F = σ0·x until |F| reaches Fc + e(t_dwell)
/// sliding: F = [Fc + e·b(v(t − τL))]·sgn(v) + σ2·v, b(v) = 1/(1 + (v/vs)²)
/// dwell: e(t) = e∞ − (e∞ − e₀)·γ/(t + γ), e₀ = e·b at the end of the last sliding
/// [B. Armstrong-Hélouvry, Control of Machines with Friction, 1991; Armstrong-Hélouvry, Dupont, Canudas de
/// Wit, Automatica 30, 1994]
/// The model consists of two models and does not define the transition between them. Here sliding ends when
/// the velocity becomes zero or reverses, and the spring starts at the torque that sliding had then without
/// its viscous part, so that friction is continuous. This is passive: since b <= 1, the spring starts with no
/// more than the last breakaway left.
/// The delay is a true one, stored as eight intervals of τL/8: a change of velocity arrives after τL and
/// takes up to τL/8; longer steps blur it to their own length.
/// The spring has no damper; a stuck joint rings until something else damps it. Stable for dt < 2·√(J/σ0)
/// without viscous friction, see coupled_step_limit_s(). Exact for the spring, dwell, and breakaway in a
/// step.
class Armstrong {
 public:
  static constexpr std::string_view kName = "armstrong";
  struct Parameters {  // defaults: wheel 1 below 1 rad/s, thesis table 4 and 2.5.2; no memory was identified
    double coulomb_Nm = 0.03718;                  ///< Fc
    double static_excess_Nm = 0.05258;            ///< e∞, breakaway above Fc after a long rest
    double stribeck_velocity_rad_per_s = 0.1516;  ///< vs
    double viscous_Nm_s_per_rad = 0.01898;        ///< σ2
    double stiffness_Nm_per_rad = 250;            ///< σ0
    double memory_s = 0.01;                       ///< τL, 0 without
    double dwell_s = 1.0;                         ///< γ, 0: breakaway does not depend on the rest
  };
  static constexpr auto kParameters = std::to_array<ParameterInfo<Parameters>>(
      {rows::coulomb<Parameters>(0),
       {"static_excess_Nm", member<&Parameters::static_excess_Nm>, 0, rows::kMaxTorque_Nm},
       rows::stribeck_velocity<Parameters>(),
       rows::viscous<Parameters>(),
       rows::stiffness<Parameters>(),
       {"memory_s", member<&Parameters::memory_s>, 0, 100},
       {"dwell_s", member<&Parameters::dwell_s>, 0, 1e6}});

  /// @throws std::invalid_argument as checked()
  explicit Armstrong(const Parameters& parameters) : parameters_(checked<Armstrong>(parameters)) {}
  const Parameters& parameters() const noexcept { return parameters_; }

  double step(State& state, const Contact& contact, double dt_s) const noexcept;
  /// After a long rest.
  double steady_Nm(double velocity_rad_per_s) const noexcept;
  /// During sliding, what breakaway left counts as stored: the next arrest may use it again.
  double stored_energy_J(const State& state) const noexcept;
  double max_step_s(double inertia_kg_m2) const noexcept {
    return coupled_step_limit_s(parameters_.stiffness_Nm_per_rad, parameters_.viscous_Nm_s_per_rad,
                                inertia_kg_m2);
  }

 private:
  double stribeck_share(double velocity_rad_per_s) const noexcept;
  double remembered_velocity(State& state, double velocity_rad_per_s, double dt_s) const noexcept;

  Parameters parameters_;
};

}  // namespace model::friction
