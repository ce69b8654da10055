/// @file
/// Common interface of all friction laws of a joint.
///
/// A law turns the velocity of a joint into its friction torque. All laws are rotational (N·m, rad, s, joint
/// side) and symmetric in direction unless stated otherwise; with N and m they work the same. Friction is
/// positive against positive motion: J·dv/dt = τ_applied − friction.
///
/// One step holds the velocity constant, as a sampled controller knows it, and advances the law's inner state
/// exactly for that (a law without closed solution states its accuracy instead). The returned torque is that
/// at the end of the step. For the elastic laws this keeps them passive in each step — it is never less than
/// the mean while the deflection grows — and stable under
///   v' = v + dt/J·(τ − friction(v)),
/// where a mean over the step would not be. The maximum step is max_step_s().
///
/// A velocity, applied torque or step that is not a usable number (see usable()) is a fault of the caller:
/// the state is unchanged and 0 is returned, so that one bad sample neither spoils later ones nor makes a
/// compensator push.
#pragma once
#include <array>
#include <cmath>
#include <concepts>
#include <cstddef>
#include <string_view>

namespace model::friction {

inline constexpr std::size_t kStateCapacity = 16;
/// Memory of a law. All zero is a joint at rest, relaxed, for a long time. The law defines the entries; a
/// copy is a snapshot.
struct State {
  std::array<double, kStateCapacity> x{};
};

struct Contact {
  double velocity_rad_per_s = 0.0;
  /// Sum of all torques on the joint except friction. Only used at rest, by laws that stick without a spring.
  double applied_torque_Nm = 0.0;
};

/// Beyond any mechanical value; products of them still fit a double.
inline constexpr double kTopSpeed_rad_per_s = 1e9;
inline constexpr double kLongestStep_s = 1e6;

/// The comparisons are false for NaN.
inline bool usable(const Contact& contact, double dt_s) noexcept {
  return std::abs(contact.velocity_rad_per_s) <= kTopSpeed_rad_per_s &&
         std::isfinite(contact.applied_torque_Nm) && dt_s >= 0 && dt_s <= kLongestStep_s;
}

/// Maximum number of parallel elements of a law.
inline constexpr std::size_t kMaxElements = 10;

/// Location of a value in a law's Parameters: member<&P::coulomb_Nm>, or entry<&P::share, 3> of an array.
template <auto kMember, class P>
constexpr double& member(P& parameters) {
  return parameters.*kMember;
}
template <auto kMember, std::size_t kIndex, class P>
constexpr double& entry(P& parameters) {
  return (parameters.*kMember)[kIndex];
}

/// One row of a law's table. Every point within the bounds is a valid law unless the law states otherwise, so
/// that a fit needs no other constraint.
template <class P>
struct ParameterInfo {
  std::string_view name;  ///< ends with its unit; dimensionless without one
  double& (*in)(P&);
  double lower;
  double upper;

  constexpr double of(P parameters) const { return in(parameters); }
};

/// A friction law.
/// `steady_Nm(v)`: torque after a long time at v. At +0 and −0 its limit from that side: the torque to
/// overcome to start. `max_step_s(J)`: longest stable step for a joint of inertia J [kg·m²], as above.
/// Parameters are checked first: without them nothing else is instantiated, in particular AnyLaw's copy,
/// which checks this concept itself. clang-format 14 breaks the arrows apart.
/// clang-format off
template <class L>
concept Law = requires {
  typename L::Parameters;
}
&&std::copyable<L>&& std::constructible_from<L, const typename L::Parameters&>&& requires(
    const L& law, State& state, const Contact& contact, double value) {
  { L::kName } -> std::convertible_to<std::string_view>;
  { L::kParameters.front() } -> std::convertible_to<ParameterInfo<typename L::Parameters>>;
  { law.parameters() }
  noexcept->std::same_as<const typename L::Parameters&>;
  { law.step(state, contact, value) }
  noexcept->std::same_as<double>;
  { law.steady_Nm(value) }
  noexcept->std::same_as<double>;
  { law.max_step_s(value) }
  noexcept->std::same_as<double>;
};

/// Has springs inside. Their energy [J] never exceeds the energy put in, unless the law states otherwise.
template <class L>
concept StoresEnergy = Law<L> && requires(const L& law, const State& state) {
  { law.stored_energy_J(state) }
  noexcept->std::same_as<double>;
};

/// Reports when it holds the joint rigidly: the integrator then sets the velocity to zero.
template <class L>
concept HoldsRigidly = Law<L> && requires(const L& law, const Contact& contact) {
  { law.holds(contact) }
  noexcept->std::same_as<bool>;
};
// clang-format on

/// For a spring k [N·m/rad] with damper d [N·m·s/rad] that holds J, with the torque from the deflection at
/// the end and the velocity at the beginning of the step: dt²·k/J + 2·dt·d/J < 4, from Jury's criterion on
/// [[1, dt], [−dt·k/J, 1 − dt²·k/J − dt·d/J]]. Infinite if k and d are zero.
inline double coupled_step_limit_s(double k, double d, double inertia_kg_m2) noexcept {
  return 4 * inertia_kg_m2 / (d + std::sqrt(d * d + 4 * inertia_kg_m2 * k));
}

/// @throws std::invalid_argument naming law, parameter, value and bounds, unless lower <= value <= upper.
void require_within(std::string_view law, std::string_view parameter, double value, double lower,
                    double upper);

/// The parameters themselves, once all are within their bounds. @throws std::invalid_argument
template <class L>
const typename L::Parameters& checked(const typename L::Parameters& parameters) {
  for (const auto& info : L::kParameters)
    require_within(L::kName, info.name, info.of(parameters), info.lower, info.upper);
  return parameters;
}

}  // namespace model::friction
