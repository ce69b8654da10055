/// @file
/// Effects on the friction of a joint that slides.
#pragma once
#include <algorithm>
#include <array>
#include <cmath>

#include "model/effects/effect.h"
#include "model/friction/stribeck_curve.h"

namespace model::effects {

struct CoulombParameters {
  double torque_Nm = 0.04;
};

/// Friction that does not depend on speed.
class Coulomb : public WithParameters<Coulomb, CoulombParameters> {
 public:
  static constexpr std::string_view kName = "coulomb";
  static constexpr std::string_view kShows =
      "a constant torque against the motion, at every speed, that changes sign with direction";
  static constexpr auto kParameters = std::to_array<ParameterInfo<CoulombParameters>>(
      {{"torque_Nm", member<&CoulombParameters::torque_Nm>, 0, kMaxTorque_Nm}});
  static constexpr auto kAmplitudes = std::to_array<std::string_view>({"torque_Nm"});
  using WithParameters::WithParameters;

  double level_Nm(const Sliding& /*sliding*/) const noexcept { return parameters_.torque_Nm; }
};

struct ViscousParameters {
  double coefficient_Nm_s_per_rad = 0.0125;
};

/// Friction in proportion to speed.
class Viscous : public WithParameters<Viscous, ViscousParameters> {
 public:
  static constexpr std::string_view kName = "viscous";
  static constexpr std::string_view kShows = "a torque against the motion that grows in proportion to speed";
  static constexpr auto kParameters = std::to_array<ParameterInfo<ViscousParameters>>(
      {{"coefficient_Nm_s_per_rad", member<&ViscousParameters::coefficient_Nm_s_per_rad>, 0, 1e4}});
  static constexpr auto kAmplitudes = std::to_array<std::string_view>({"coefficient_Nm_s_per_rad"});
  using WithParameters::WithParameters;

  double level_Nm(const Sliding& sliding) const noexcept {
    return parameters_.coefficient_Nm_s_per_rad * sliding.speed_rad_per_s;
  }
};

struct StribeckParameters {
  double static_torque_Nm = 0.08;   ///< Fs, all of it: Coulomb friction included
  double velocity_rad_per_s = 0.3;  ///< vs
  double exponent = 2;              ///< δ
  double tail = 0;                  ///< q
};

/// Friction that is higher at rest and falls as the joint begins to slide.
/// (Fs − Fc)·exp(−(|v|/vs)^δ) above the Coulomb torque Fc [friction.md 3; thesis 2.3]
/// With a tail, (Fs − Fc)·(1 + q·(|v|/vs)^δ)^(−1/q): q = 1 is the form of Hess and Soom (ASME J. Tribology
/// 112, 1990), which still falls where the other form has decayed.
class Stribeck : public WithParameters<Stribeck, StribeckParameters> {
 public:
  static constexpr std::string_view kName = "stribeck";
  static constexpr std::string_view kShows =
      "break-away above the sliding torque; friction falls with speed near standstill";
  static constexpr auto kParameters = std::to_array<ParameterInfo<StribeckParameters>>(
      {{"static_torque_Nm", member<&StribeckParameters::static_torque_Nm>, 0, kMaxTorque_Nm},
       {"velocity_rad_per_s", member<&StribeckParameters::velocity_rad_per_s>, 1e-4, kMaxSpeed_rad_per_s},
       {"exponent", member<&StribeckParameters::exponent>, 0.3, 4},
       {"tail", member<&StribeckParameters::tail>, 0, 1}});
  static constexpr auto kAmplitudes = std::to_array<std::string_view>({"static_torque_Nm"});
  using WithParameters::WithParameters;

  double level_Nm(const Sliding& sliding) const noexcept {
    return (parameters_.static_torque_Nm - sliding.coulomb_Nm) *
           shape(sliding.speed_rad_per_s, parameters_.velocity_rad_per_s, parameters_.exponent,
                 parameters_.tail);
  }
  /// 1 at rest, towards 0 at speed.
  static double shape(double speed_rad_per_s, double velocity_rad_per_s, double exponent,
                      double tail = 0) noexcept {
    const double ratio = speed_rad_per_s / velocity_rad_per_s;
    if (tail == 0) return model::friction::stribeck_share(ratio, exponent);
    return std::pow(1 + tail * std::pow(ratio, exponent), -1 / tail);
  }
};

struct DirectionAsymmetryParameters {
  double coulomb_Nm = 0;
  double viscous_Nm_s_per_rad = 0;
};

/// Friction that differs by direction.
/// Half the difference between positive and negative motion.
class DirectionAsymmetry : public WithParameters<DirectionAsymmetry, DirectionAsymmetryParameters> {
 public:
  static constexpr std::string_view kName = "direction_asymmetry";
  static constexpr std::string_view kShows =
      "more torque one way than the other; while the joint slides, its constant part is the same as a torque "
      "offset";
  static constexpr auto kParameters = std::to_array<ParameterInfo<DirectionAsymmetryParameters>>(
      {{"coulomb_Nm", member<&DirectionAsymmetryParameters::coulomb_Nm>, -kMaxTorque_Nm, kMaxTorque_Nm},
       {"viscous_Nm_s_per_rad", member<&DirectionAsymmetryParameters::viscous_Nm_s_per_rad>, -1e4, 1e4}});
  static constexpr auto kAmplitudes = std::to_array<std::string_view>({"coulomb_Nm", "viscous_Nm_s_per_rad"});
  using WithParameters::WithParameters;

  double level_Nm(const Sliding& sliding) const noexcept {
    return sliding.direction *
           (parameters_.coulomb_Nm + parameters_.viscous_Nm_s_per_rad * sliding.speed_rad_per_s);
  }
};

struct MidspeedDipParameters {
  double depth_Nm = 0.01;
  double centre_rad_per_s = 2.5;
  double width_rad_per_s = 1;
};

/// A range of speed in which friction falls below the straight line:
/// −depth·exp(−((|v| − centre)/width)²); measured on youBot wheels between about 1 and 4 rad/s.
class MidspeedDip : public WithParameters<MidspeedDip, MidspeedDipParameters> {
 public:
  static constexpr std::string_view kName = "midspeed_dip";
  static constexpr std::string_view kShows =
      "less friction than Coulomb and viscous in a band of speed, both directions, back on the line above it";
  static constexpr auto kParameters = std::to_array<ParameterInfo<MidspeedDipParameters>>(
      {{"depth_Nm", member<&MidspeedDipParameters::depth_Nm>, 0, kMaxTorque_Nm},
       {"centre_rad_per_s", member<&MidspeedDipParameters::centre_rad_per_s>, 0, kMaxSpeed_rad_per_s},
       {"width_rad_per_s", member<&MidspeedDipParameters::width_rad_per_s>, 1e-3, kMaxSpeed_rad_per_s}});
  using WithParameters::WithParameters;

  double level_Nm(const Sliding& sliding) const noexcept {
    return -parameters_.depth_Nm *
           shape(sliding.speed_rad_per_s, parameters_.centre_rad_per_s, parameters_.width_rad_per_s);
  }
  /// 1 in the middle of the range, towards 0 outside.
  static double shape(double speed_rad_per_s, double centre_rad_per_s, double width_rad_per_s) noexcept {
    const double off = (speed_rad_per_s - centre_rad_per_s) / width_rad_per_s;
    return std::exp(-off * off);
  }
};

struct QuadraticDragParameters {
  double coefficient_Nm_s2_per_rad2 = 0.0005;
};

/// Friction proportional to the square of speed: stirred grease, air; negative in a fitted curve that bends
/// down.
class QuadraticDrag : public WithParameters<QuadraticDrag, QuadraticDragParameters> {
 public:
  static constexpr std::string_view kName = "quadratic_drag";
  static constexpr std::string_view kShows =
      "friction curves away from the straight line more the faster the joint is";
  static constexpr auto kParameters = std::to_array<ParameterInfo<QuadraticDragParameters>>(
      {{"coefficient_Nm_s2_per_rad2", member<&QuadraticDragParameters::coefficient_Nm_s2_per_rad2>, -1e4,
        1e4}});
  static constexpr auto kAmplitudes = std::to_array<std::string_view>({"coefficient_Nm_s2_per_rad2"});
  using WithParameters::WithParameters;

  double level_Nm(const Sliding& sliding) const noexcept {
    return parameters_.coefficient_Nm_s2_per_rad2 * sliding.speed_rad_per_s * sliding.speed_rad_per_s;
  }
};

struct LoadFrictionParameters {
  double share = 0.1;            ///< µ, of the transmitted torque while the motor drives
  double backdriving_ratio = 1;  ///< share while the load drives the motor, over µ
  double load_share = 0;         ///< of the joint's own inertia and friction, behind the gear
};

/// Friction in proportion to the torque X that the gear transmits: the load's, and a share of that which the
/// joint itself needs to accelerate and slide. The efficiency is 1/(1 + µ) in driving and 1 − µ·ratio in
/// back-driving; at a share of 1 the gear locks itself.
/// [W. Duclusaud et al., ICRA 2025, arXiv 2410.08650; Bittencourt et al., IROS 2010; A. Wang, S. Kim,
/// "Directional efficiency in geared transmissions", ICRA 2015]
class LoadFriction : public WithParameters<LoadFriction, LoadFrictionParameters> {
 public:
  static constexpr double kMaxRatio = 20;
  static constexpr std::string_view kName = "load_friction";
  static constexpr std::string_view kShows =
      "more friction the more torque the gear transmits, often more in driving than in back-driving";
  static constexpr auto kParameters = std::to_array<ParameterInfo<LoadFrictionParameters>>(
      {{"share", member<&LoadFrictionParameters::share>, 0, 2},
       {"backdriving_ratio", member<&LoadFrictionParameters::backdriving_ratio>, 0, kMaxRatio},
       {"load_share", member<&LoadFrictionParameters::load_share>, 0, 1}});
  using WithParameters::WithParameters;

  /// Of a transmitted torque, positive where the motor drives.
  double loss_Nm(double transmitted_Nm) const noexcept {
    return transmitted_Nm > 0 ? parameters_.share * transmitted_Nm : -backdriving_share() * transmitted_Nm;
  }
  /// All torques are positive along the motion: of the load against it, and of the joint's own inertia and
  /// other friction.
  double transmitted_Nm(double load_Nm, double own_Nm) const noexcept {
    return load_Nm + parameters_.load_share * own_Nm;
  }
  /// The same where the motor's torque is known instead of the acceleration: own = motor − load − loss.
  double transmitted_under_Nm(double load_Nm, double motor_Nm) const noexcept {
    const double without_loss = (1 - parameters_.load_share) * load_Nm + parameters_.load_share * motor_Nm;
    return without_loss / (without_loss > 0
                               ? 1 + parameters_.load_share * parameters_.share
                               : std::max(1 - parameters_.load_share * backdriving_share(), kMinKept));
  }

 private:
  /// A mass behind a gear that locks itself stops at once: within a few steps of a simulation.
  static constexpr double kMinKept = 0.05;
  double backdriving_share() const noexcept { return parameters_.share * parameters_.backdriving_ratio; }
};

struct ThermalDriftParameters {
  double coulomb_change_Nm = -0.01;        ///< once warm
  double viscous_change_Nm_s_per_rad = 0;  ///< once warm
  double time_constant_s = 60;             ///< T
};

/// Friction that changes as the drive warms up.
/// (1 − exp(−t/T)) times the change, from a cold start.
class ThermalDrift : public WithParameters<ThermalDrift, ThermalDriftParameters> {
 public:
  static constexpr std::string_view kName = "thermal_drift";
  static constexpr std::string_view kShows =
      "friction at the same speed differs between the beginning and the end of a recording";
  static constexpr auto kParameters = std::to_array<ParameterInfo<ThermalDriftParameters>>(
      {{"coulomb_change_Nm", member<&ThermalDriftParameters::coulomb_change_Nm>, -kMaxTorque_Nm,
        kMaxTorque_Nm},
       {"viscous_change_Nm_s_per_rad", member<&ThermalDriftParameters::viscous_change_Nm_s_per_rad>, -1e4,
        1e4},
       {"time_constant_s", member<&ThermalDriftParameters::time_constant_s>, 1, 1e5}});
  using WithParameters::WithParameters;

  double level_Nm(const Sliding& sliding) const noexcept {
    return shape(sliding.running_s, parameters_.time_constant_s) *
           (parameters_.coulomb_change_Nm +
            parameters_.viscous_change_Nm_s_per_rad * sliding.speed_rad_per_s);
  }
  /// 0 cold, 1 warm.
  static double shape(double running_s, double time_constant_s) noexcept {
    return -std::expm1(-running_s / time_constant_s);
  }
};

struct PositionFrictionParameters {
  double amplitude_Nm = 0.01;  ///< A
  double periods_per_rev = 1;  ///< N, of the joint
  double phase_rad = 0;        ///< φ
};

/// One harmonic of a friction that depends on where the joint is: a bent shaft, an oval bearing, a tight
/// spot. A·sin(N·θ + φ); a map over one turn, or over a stroke, is several of these.
class PositionFriction : public WithParameters<PositionFriction, PositionFrictionParameters> {
 public:
  static constexpr std::string_view kName = "position_friction";
  static constexpr std::string_view kShows =
      "friction repeats over position: what brakes more at a place does so in both directions";
  static constexpr auto kParameters = std::to_array<ParameterInfo<PositionFrictionParameters>>(
      {{"amplitude_Nm", member<&PositionFrictionParameters::amplitude_Nm>, 0, kMaxTorque_Nm},
       {"periods_per_rev", member<&PositionFrictionParameters::periods_per_rev>, 1e-3, 1e5},
       {"phase_rad", member<&PositionFrictionParameters::phase_rad>, -6.2831853072, 6.2831853072}});
  using WithParameters::WithParameters;

  double level_Nm(const Sliding& sliding) const noexcept {
    return parameters_.amplitude_Nm *
           std::sin(parameters_.periods_per_rev * sliding.position_rad + parameters_.phase_rad);
  }
};

}  // namespace model::effects
