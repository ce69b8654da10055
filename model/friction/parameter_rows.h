/// @file
/// Parameters that several laws share: one name, one unit, one pair of bounds each.
#pragma once
#include <array>
#include <cstddef>
#include <utility>

#include "model/friction/law.h"

namespace model::friction::rows {

// From the pivot of an instrument to a crane's slew ring; divisors are not zero.
inline constexpr double kMinTorque_Nm = 1e-9;
inline constexpr double kMaxTorque_Nm = 1e4;

template <class P>
constexpr ParameterInfo<P> coulomb(double lower = kMinTorque_Nm) {
  return {"coulomb_Nm", member<&P::coulomb_Nm>, lower, kMaxTorque_Nm};
}
template <class P>
constexpr ParameterInfo<P> static_torque(double lower = kMinTorque_Nm) {
  return {"static_Nm", member<&P::static_Nm>, lower, kMaxTorque_Nm};
}
template <class P>
constexpr ParameterInfo<P> stribeck_velocity() {
  return {"stribeck_velocity_rad_per_s", member<&P::stribeck_velocity_rad_per_s>, 1e-6, 1e3};
}
template <class P>
constexpr ParameterInfo<P> stribeck_exponent() {
  return {"stribeck_exponent", member<&P::stribeck_exponent>, 0.1, 10};
}
template <class P>
constexpr ParameterInfo<P> viscous() {
  return {"viscous_Nm_s_per_rad", member<&P::viscous_Nm_s_per_rad>, 0, 1e4};
}
template <class P>
constexpr ParameterInfo<P> stiffness() {
  return {"stiffness_Nm_per_rad", member<&P::stiffness_Nm_per_rad>, 1e-6, 1e8};
}
template <class P>
constexpr ParameterInfo<P> damping() {
  return {"damping_Nm_s_per_rad", member<&P::damping_Nm_s_per_rad>, 0, 1e5};
}

template <class P, std::size_t N, std::size_t M>
constexpr std::array<ParameterInfo<P>, N + M> joined(const std::array<ParameterInfo<P>, N>& first,
                                                     const std::array<ParameterInfo<P>, M>& second) {
  return [&]<std::size_t... I, std::size_t... K>(std::index_sequence<I...>, std::index_sequence<K...>) {
    return std::array<ParameterInfo<P>, N + M>{first[I]..., second[K]...};
  }
  (std::make_index_sequence<N>(), std::make_index_sequence<M>());
}

}  // namespace model::friction::rows
