/// @file
/// A position or a force as three plain numbers: drivers do without Eigen.
#pragma once
#include <algorithm>
#include <array>
#include <cmath>

namespace drivers::haptic {

using Vector3 = std::array<double, 3>;

inline bool is_finite(const Vector3& v) noexcept {
  return std::ranges::all_of(v, [](double component) { return std::isfinite(component); });
}

inline Vector3 times(const Vector3& v, double factor) noexcept {
  return {v[0] * factor, v[1] * factor, v[2] * factor};
}

/// True when `v` was longer. A length that overflows leaves zero.
inline bool shorten(Vector3& v, double longest) noexcept {
  const double length = std::hypot(v[0], v[1], v[2]);
  if (length <= longest) return false;
  v = times(v, longest / length);
  return true;
}

}  // namespace drivers::haptic
