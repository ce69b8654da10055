/// @file
/// Common interface of all effects of a drive.
///
/// A drive is a chain: command → actuator → delivered torque → J·a = τ − friction − load → transmission →
/// sensor → measured. An effect is one physical phenomenon somewhere in it: a small type with parameters, and
/// the one function by which it acts there,
///
///   deliver(ActuatorMemory&, torque, dt)  the actuator delivers another torque than commanded
///   level_Nm(Sliding)                adds to the sliding friction: positive takes more torque
///   loss_Nm(transmitted)             the gear takes a part of the torque that it transmits
///   load_Nm(position)                a torque against positive motion that depends on position; on the load,
///                                    or on the motor if kOnMotor says so
///   arrange(Mechanics&)              changes masses, springs and gaps
///   report_Nm(torque)                the sensor reports another torque than delivered
///   gain(position)                   the motor makes that share of the torque that its current means
///   error(position)                  the encoder reports another position of the motor
///
/// and a sentence on how it appears in measured data. Everything is joint side and SI. Simulation, fits and
/// the search for missing effects use the same types.
#pragma once
#include <algorithm>
#include <array>
#include <cmath>
#include <concepts>
#include <numbers>
#include <string_view>

#include "model/effects/delay_line.h"
#include "model/friction/law.h"

namespace model::effects {

using model::friction::member;
using model::friction::ParameterInfo;

/// Long after a reversal, where nothing changes any more.
inline constexpr double kLongSinceReversal_s = 1e9;

/// A sliding joint, as input of friction.
struct Sliding {
  double speed_rad_per_s = 0;  ///< >= 0
  double direction = 1;        ///< +1 or -1
  double running_s = 0;        ///< since the cold start of the drive
  double coulomb_Nm = 0;       ///< sum of the coulomb effects
  double load_Nm = 0;          ///< magnitude of the load's torque
  double position_rad = 0;
  double since_reversal_s = kLongSinceReversal_s;  ///< since the velocity last changed sign
};

/// A sliding joint with the torques that its gear transmits.
struct Slide {
  double speed_rad_per_s = 0;  ///< >= 0
  double direction = 1;        ///< +1 or -1
  double running_s = 0;        ///< since the cold start of the drive
  double position_rad = 0;
  double since_reversal_s = kLongSinceReversal_s;  ///< since the velocity last changed sign
  double load_Nm = 0;                              ///< torque of the load, against positive motion
  double inertial_Nm = 0;                          ///< inertia times acceleration, of the whole joint
};

/// What an encoder adds to a position, with its first and second derivative over the position.
struct EncoderError {
  double value_rad = 0;
  double slope = 0;
  double bend_per_rad = 0;
};

/// Masses and springs of the drive. One mass, unless there is a gap or a spring.
struct Mechanics {
  double inertia_kg_m2 = 0.0112;
  double stiffness_Nm_per_rad = 0;  ///< of the friction contact (σ0); 0: maximum that the step allows
  double damping_Nm_s_per_rad = 0;  ///< of the friction contact (σ1), while it sticks
  double bend_exponent = 0;         ///< of the friction contact (Dahl's α), towards sliding
  double backlash_rad = 0;          ///< free travel between motor and load
  double shaft_Nm_per_rad = 0;      ///< spring between motor and load; 0: rigid
  double shaft_Nm_s_per_rad = 0;    ///< its damping
  double load_share = 0;            ///< of inertia, behind gap and spring
  double friction_ratio = 1;        ///< share of friction behind them, over that of inertia
  double flank_loss_s_per_rad = 0;  ///< α: flanks that collide at a low speed v separate at (1 − α·v)·v
  double flank_damping_ratio = 0;   ///< ζ of that resonance: flanks lose the same share at each speed
  double flank_Hz = 150;            ///< resonance of both masses on a flank of the gap
  bool two_masses() const noexcept { return backlash_rad > 0 || shaft_Nm_per_rad > 0; }
  /// Clamped so that each mass has some friction.
  double friction_share() const noexcept { return std::clamp(friction_ratio * load_share, 1e-3, 1 - 1e-3); }
  /// Torque from motor to load over a step on a flank with the compression `pressed_rad`, of either sign,
  /// which grows while `rate_rad_per_s` has the same sign: k·δ·(1 + 3/2·α·dδ/dt) + 2ζ·√(k·J)·dδ/dt, never
  /// pulling. At most the torque that stops one body on the other: flanks that collide fast lose all their
  /// speed within a step. [α: K. H. Hunt, F. R. E. Crossley, J. Applied Mechanics 42:440, 1975]
  double flank_Nm(double pressed_rad, double rate_rad_per_s, double step_s) const noexcept {
    const double closing = pressed_rad < 0 ? -rate_rad_per_s : rate_rad_per_s;
    const double spring_Nm = flank_Nm_per_rad() * pressed_rad;
    const double stops_Nm = reduced_inertia_kg_m2() / step_s * std::abs(rate_rad_per_s);
    const double most_Nm = std::abs(spring_Nm) + stops_Nm;
    const double pressing_Nm =
        std::abs(spring_Nm) * (1 + 1.5 * flank_loss_s_per_rad * closing) +
        2 * flank_damping_ratio * reduced_inertia_kg_m2() * 2 * std::numbers::pi * flank_Hz * closing;
    return std::copysign(std::clamp(pressing_Nm, 0.0, most_Nm), pressed_rad);
  }
  double reduced_inertia_kg_m2() const noexcept { return inertia_kg_m2 * load_share * (1 - load_share); }
  double flank_Nm_per_rad() const noexcept {
    const double rad_per_s = 2 * std::numbers::pi * flank_Hz;
    return reduced_inertia_kg_m2() * rad_per_s * rad_per_s;
  }
};

// clang-format 14 breaks the arrows apart.
// clang-format off
template <class E>
concept ActsOnActuator = requires(const E& e, ActuatorMemory& memory, double x) { { e.deliver(memory, x, x) } noexcept -> std::same_as<double>; };
template <class E>
concept ActsOnFriction = requires(const E& e, const Sliding& s) { { e.level_Nm(s) } noexcept -> std::same_as<double>; };
template <class E>
concept ActsOnGear = requires(const E& e, double x) { { e.loss_Nm(x) } noexcept -> std::same_as<double>; };
template <class E>
concept ActsOnPosition = requires(const E& e, double x) { { e.load_Nm(x) } noexcept -> std::same_as<double>; };
template <class E>
concept ActsOnMotor = ActsOnPosition<E> && requires { requires E::kOnMotor; };
template <class E>
concept ActsOnMechanics = requires(const E& e, Mechanics& m) { { e.arrange(m) } noexcept -> std::same_as<void>; };
template <class E>
concept ActsOnSensor = requires(const E& e, double x) { { e.report_Nm(x) } noexcept -> std::same_as<double>; };
template <class E>
concept ActsOnMotorTorque = requires(const E& e, double x) { { e.gain(x) } noexcept -> std::same_as<double>; };
template <class E>
concept ActsOnEncoder = requires(const E& e, double x) { { e.error(x) } noexcept -> std::same_as<EncoderError>; };

template <class E>
concept Effect =
    requires(const E& e) {
      typename E::Parameters;
      { E::kName } -> std::convertible_to<std::string_view>;
      { E::kShows } -> std::convertible_to<std::string_view>;
      { E::kParameters.size() };
      { e.parameters() } noexcept -> std::same_as<const typename E::Parameters&>;
    } && std::constructible_from<E, const typename E::Parameters&> &&
    (ActsOnActuator<E> || ActsOnFriction<E> || ActsOnGear<E> || ActsOnPosition<E> || ActsOnMechanics<E> || ActsOnSensor<E> ||
     ActsOnMotorTorque<E> || ActsOnEncoder<E>);
// clang-format on

/// kAmplitudes lists the parameters in which its torque is linear; the others are its shape.
template <class E>
concept Linear = requires {
  E::kAmplitudes;
};

/// @throws std::invalid_argument naming effect, parameter, value and bounds, unless lower <= value <= upper.
void require_within(std::string_view effect, std::string_view parameter, double value, double lower,
                    double upper);

/// Common base of all effects: parameters that are within their bounds.
template <class E, class P>
class WithParameters {
 public:
  using Parameters = P;
  /// @throws std::invalid_argument as require_within()
  explicit WithParameters(const P& parameters) : parameters_(parameters) {
    for (const auto& info : E::kParameters)
      require_within(E::kName, info.name, info.of(parameters), info.lower, info.upper);
  }
  const P& parameters() const noexcept { return parameters_; }

 protected:
  P parameters_;
};

// Range: from the pivot of an instrument to a crane's slew ring.
inline constexpr double kMaxTorque_Nm = 1e4;
inline constexpr double kMaxSpeed_rad_per_s = 1e4;

}  // namespace model::effects
