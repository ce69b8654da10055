/// @file
/// Effects that depend on where the joint is.
#pragma once
#include <array>
#include <cmath>

#include "model/effects/effect.h"

namespace model::effects {

struct TorqueOffsetParameters {
  double torque_Nm = 0.005;  ///< positive against positive motion
};

/// A constant torque on the joint: a weight on a drum, a preloaded spring, an offset of the current sensor.
class TorqueOffset : public WithParameters<TorqueOffset, TorqueOffsetParameters> {
 public:
  static constexpr std::string_view kName = "torque_offset";
  static constexpr std::string_view kShows =
      "more torque one way than the other by the same amount at every speed";
  static constexpr auto kParameters = std::to_array<ParameterInfo<TorqueOffsetParameters>>(
      {{"torque_Nm", member<&TorqueOffsetParameters::torque_Nm>, -kMaxTorque_Nm, kMaxTorque_Nm}});
  static constexpr auto kAmplitudes = std::to_array<std::string_view>({"torque_Nm"});
  using WithParameters::WithParameters;

  double load_Nm(double /*position_rad*/) const noexcept { return parameters_.torque_Nm; }
};

struct ImbalanceParameters {
  double torque_Nm = 0.01;       ///< T, with the arm level
  double rest_position_rad = 0;  ///< θ0
};

/// A weight off the axis.
/// T·sin(θ − θ0): pulls back to θ0, where it hangs.
class Imbalance : public WithParameters<Imbalance, ImbalanceParameters> {
 public:
  static constexpr std::string_view kName = "imbalance";
  static constexpr std::string_view kShows = "torque repeats once per turn of the joint, whatever the speed";
  static constexpr auto kParameters = std::to_array<ParameterInfo<ImbalanceParameters>>(
      {{"torque_Nm", member<&ImbalanceParameters::torque_Nm>, 0, kMaxTorque_Nm},
       {"rest_position_rad", member<&ImbalanceParameters::rest_position_rad>, -6.2831853072, 6.2831853072}});
  using WithParameters::WithParameters;

  double load_Nm(double position_rad) const noexcept {
    return parameters_.torque_Nm * std::sin(position_rad - parameters_.rest_position_rad);
  }
};

struct CoggingParameters {
  double amplitude_Nm = 0.01;   ///< A
  double periods_per_rev = 26;  ///< N, of the joint
  double phase_rad = 0;         ///< φ
};

/// One harmonic of a torque ripple over the joint angle: magnets and slots, gear teeth on the motor's side.
/// A·sin(N·θ + φ); a ripple with several harmonics is several of these.
class Cogging : public WithParameters<Cogging, CoggingParameters> {
 public:
  static constexpr std::string_view kName = "cogging";
  static constexpr std::string_view kShows =
      "torque repeats over position, a whole number of times per turn of motor or joint";
  static constexpr auto kParameters = std::to_array<ParameterInfo<CoggingParameters>>(
      {{"amplitude_Nm", member<&CoggingParameters::amplitude_Nm>, 0, kMaxTorque_Nm},
       {"periods_per_rev", member<&CoggingParameters::periods_per_rev>, 0.5, 1e5},
       {"phase_rad", member<&CoggingParameters::phase_rad>, -6.2831853072, 6.2831853072}});
  static constexpr bool kOnMotor = true;
  using WithParameters::WithParameters;

  double load_Nm(double position_rad) const noexcept {
    return parameters_.amplitude_Nm *
           std::sin(parameters_.periods_per_rev * position_rad + parameters_.phase_rad);
  }
};

}  // namespace model::effects
