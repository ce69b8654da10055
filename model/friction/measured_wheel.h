/// @file
/// The four measured wheel curves as a friction law.
#pragma once
#include <array>

#include "model/friction/parameter_rows.h"
#include "model/friction/sliding_table.h"

namespace model::friction {

/// F = scale·curve(v)·sgn(v), from a table with a spacing of 0.005 rad/s (differences to the published curve:
/// SlidingTable). Below its peak near 0.05 to 0.1 rad/s the curve rises with speed: the table holds the peak
/// down to rest, or with v_held that level only below v_held, and then the joint creeps at torques between
/// that level and the peak. Below 0.02 rad/s the
/// published curve is a line to zero. At v = 0 the applied torque, up to
/// breakaway. The only law that differs between directions. Stateless; rest is an exact zero, as for Coulomb.
/// Beyond 10 rad/s the level is held, so max_step_s() follows from the steepest rise within. Construction and
/// copy allocate the table; a step does not.
class MeasuredWheel {
 public:
  static constexpr std::string_view kName = "measured_wheel";
  struct Parameters {
    double wheel = 1;                 ///< 1 to 4, whole
    double scale = 1;                 ///< 1: lifted wheels, as measured; loaded wheels are 1.1 to 1.3
    double held_below_rad_per_s = 0;  ///< v_held; 0: the peak is held
  };
  static constexpr auto kParameters = std::to_array<ParameterInfo<Parameters>>(
      {{"wheel", member<&Parameters::wheel>, 1, 4},
       {"scale", member<&Parameters::scale>, 0, 100},
       {"held_below_rad_per_s", member<&Parameters::held_below_rad_per_s>, 0, 0.3}});

  /// @throws std::invalid_argument as checked(), or if the wheel is not a whole number.
  explicit MeasuredWheel(const Parameters& parameters);
  const Parameters& parameters() const noexcept { return parameters_; }

  double step(State& state, const Contact& contact, double dt_s) const noexcept;
  bool holds(const Contact& contact) const noexcept;
  double steady_Nm(double velocity_rad_per_s) const noexcept;
  double max_step_s(double inertia_kg_m2) const noexcept;

 private:
  Parameters parameters_;
  SlidingTable table_;
  double steepest_Nm_s_per_rad_;
};

}  // namespace model::friction
