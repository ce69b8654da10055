/// @file
/// Ten bristles that break and bond again at random places.
#pragma once
#include <array>

#include "model/friction/parameter_rows.h"

namespace model::friction {

/// F = Σ (K/N)·(x − bᵢ); a bond stretched to its reach δ breaks and forms again anywhere within reach.
/// [D. A. Haessig, B. Friedland, ASME J. Dyn. Syst. Meas. Control 113, 1991; "anywhere": uniformly
/// distributed]
/// From rest all N bonds are relaxed and break together: breakaway at K·δ. During sliding the deflection d of
/// a bond has the density (d + δ)/(2δ²), so friction has the mean K·δ/3 and, over position, the standard
/// deviation K·δ·√(2/N)/3.
/// The random numbers come from a Lehmer generator in the state: the same states and motions give the same
/// friction. A zero state has a fixed seed; another integer in State::x[kBristles], 1 to 2147483646, is
/// another seed.
/// A bond that has broken since the last reversal slides: it contributes its mean over a step, with which the
/// mean of F is exact for steps of any length. The others stick and contribute the value at the end of the
/// step, with which a joint that rings on them gains no energy (law.h). Passive in every step. If a step is
/// longer than 2·δ, friction is the mean, and new positions are drawn from the density. No damper: a stuck
/// joint rings. Stable for dt < 2·√(J/K). State: ten deflections [rad], the generator, direction of the last
/// motion, which bonds slide (a bit each).
class Bristle {
 public:
  static constexpr std::string_view kName = "bristle";
  static constexpr std::size_t kBristles = 10;
  struct Parameters {                   // defaults: the sliding level of wheel 1 (thesis table 4) as K·δ/3
    double stiffness_Nm_per_rad = 250;  ///< K, of all bristles together
    double reach_rad = 4.5e-4;          ///< δ
  };
  static constexpr auto kParameters = std::to_array<ParameterInfo<Parameters>>(
      {rows::stiffness<Parameters>(), {"reach_rad", member<&Parameters::reach_rad>, 1e-9, 10}});

  /// @throws std::invalid_argument as checked()
  explicit Bristle(const Parameters& parameters) : parameters_(checked<Bristle>(parameters)) {}
  const Parameters& parameters() const noexcept { return parameters_; }

  double step(State& state, const Contact& contact, double dt_s) const noexcept;
  /// The mean over a long way.
  double steady_Nm(double velocity_rad_per_s) const noexcept;
  double stored_energy_J(const State& state) const noexcept;
  double max_step_s(double inertia_kg_m2) const noexcept {
    return coupled_step_limit_s(parameters_.stiffness_Nm_per_rad, 0, inertia_kg_m2);
  }

 private:
  Parameters parameters_;
};

}  // namespace model::friction
