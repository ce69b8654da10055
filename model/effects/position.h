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

/// A constant torque on the joint: a weight on a drum, a preloaded spring.
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

struct SpringParameters {
  double stiffness_Nm_per_rad = 0.1;  ///< k
  double rest_position_rad = 0;       ///< θ0
};

/// A spring between the joint and the frame: one that returns the joint or carries a weight, a bent cable.
/// k·(θ − θ0): pulls back to θ0.
class Spring : public WithParameters<Spring, SpringParameters> {
 public:
  static constexpr std::string_view kName = "spring";
  static constexpr std::string_view kShows = "torque in proportion to the distance from one position";
  static constexpr auto kParameters = std::to_array<ParameterInfo<SpringParameters>>(
      {{"stiffness_Nm_per_rad", member<&SpringParameters::stiffness_Nm_per_rad>, 0, 1e6},
       {"rest_position_rad", member<&SpringParameters::rest_position_rad>, -1e4, 1e4}});
  using WithParameters::WithParameters;

  double load_Nm(double position_rad) const noexcept {
    return parameters_.stiffness_Nm_per_rad * (position_rad - parameters_.rest_position_rad);
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

struct TorqueRippleParameters {
  double share = 0.05;          ///< of the torque
  double periods_per_rev = 26;  ///< N, of the joint
  double phase_rad = 0;         ///< φ
};

/// One harmonic of a ripple in proportion to the motor's torque: back-EMF that is no sine, current sensors
/// with an offset or unequal gains, commutation. The motor makes 1 + share·sin(N·θ + φ) times the torque that
/// its current means; without torque there is no ripple, unlike with cogging.
class TorqueRipple : public WithParameters<TorqueRipple, TorqueRippleParameters> {
 public:
  static constexpr std::string_view kName = "torque_ripple";
  static constexpr std::string_view kShows =
      "the torque needed repeats over the motor's position in proportion to itself";
  static constexpr auto kParameters = std::to_array<ParameterInfo<TorqueRippleParameters>>(
      {{"share", member<&TorqueRippleParameters::share>, 0, 0.9},
       {"periods_per_rev", member<&TorqueRippleParameters::periods_per_rev>, 0.5, 1e5},
       {"phase_rad", member<&TorqueRippleParameters::phase_rad>, -6.2831853072, 6.2831853072}});
  using WithParameters::WithParameters;

  double gain(double position_rad) const noexcept {
    return 1 +
           parameters_.share * std::sin(parameters_.periods_per_rev * position_rad + parameters_.phase_rad);
  }
};

struct EncoderEccentricityParameters {
  double amplitude_rad = 1e-3;  ///< A, of the joint
  double periods_per_rev = 1;   ///< N, of the joint: the gear ratio for an encoder on the motor
  double phase_rad = 0;         ///< φ
};

/// An encoder whose disc is off the axis reports θ + A·sin(N·θ + φ) for the position θ: an error of the
/// velocity in proportion to it, and of the acceleration in proportion to its square.
class EncoderEccentricity : public WithParameters<EncoderEccentricity, EncoderEccentricityParameters> {
 public:
  static constexpr std::string_view kName = "encoder_eccentricity";
  static constexpr std::string_view kShows =
      "a torque that repeats once per turn of the encoder and grows with the square of the speed";
  static constexpr auto kParameters = std::to_array<ParameterInfo<EncoderEccentricityParameters>>(
      {{"amplitude_rad", member<&EncoderEccentricityParameters::amplitude_rad>, 0, 0.3},
       {"periods_per_rev", member<&EncoderEccentricityParameters::periods_per_rev>, 0.5, 1e5},
       {"phase_rad", member<&EncoderEccentricityParameters::phase_rad>, -6.2831853072, 6.2831853072}});
  using WithParameters::WithParameters;

  EncoderError error(double position_rad) const noexcept {
    const auto& [amplitude, periods, phase] = parameters_;
    const double angle = periods * position_rad + phase;
    const double value = amplitude * std::sin(angle);
    return {value, amplitude * periods * std::cos(angle), -periods * periods * value};
  }
};

}  // namespace model::effects
