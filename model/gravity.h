/// @file
/// Standard gravity as the thesis rounds it.
#pragma once

namespace model {

inline constexpr double kGravity_m_per_s2 = 9.81;

}  // namespace model
