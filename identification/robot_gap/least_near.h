/// @file
/// Where a smooth function of one number is least.
#pragma once
#include <algorithm>

namespace identification::robot_gap {

struct SearchRange {
  double lower;
  double upper;
  double step;  ///< the least is at most this far from the start; the first trial is half of it
};

/// From `start`, which is within the range: in halved steps, then by a parabola.
template <class Of>
double least_near(double start, const SearchRange& range, const Of& of) {
  constexpr int kHalvings = 3;
  double at = start;
  double here = of(at);
  double step = range.step;
  for (int i = 0; i < kHalvings; ++i) {
    step /= 2;
    for (const double other : {at - step, at + step}) {
      if (other < range.lower || other > range.upper) continue;
      const double there = of(other);
      if (there >= here) continue;
      here = there;
      at = other;
    }
  }
  if (at - step < range.lower || at + step > range.upper) return at;
  const double before = of(at - step);
  const double after = of(at + step);
  const double curvature = before - 2 * here + after;
  if (!(curvature > 0)) return at;
  return at + std::clamp(0.5 * (before - after) / curvature, -1.0, 1.0) * step;
}

}  // namespace identification::robot_gap
