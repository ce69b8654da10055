/// @file
/// Whether more blocks improved than chance allows.
#pragma once
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <numbers>
#include <span>

namespace identification::gap {

/// Probability that by chance this many more blocks improve than worsen, among those that changed noticeably.
/// `before`, `after`: squared misfit of each.
inline double chance_of(std::span<const double> before, std::span<const double> after) {
  constexpr double kHair = 0.02;
  int better = 0;
  int worse = 0;
  for (std::size_t i = 0; i < before.size(); ++i) {
    better += after[i] < (1 - kHair) * before[i] ? 1 : 0;
    worse += after[i] > (1 + kHair) * before[i] ? 1 : 0;
  }
  // Binomial tail: at least `better` of better + worse, both equally likely.
  const int n = better + worse;
  double tail = 0;
  for (int k = better; k <= n; ++k)
    tail +=
        std::exp(std::lgamma(n + 1) - std::lgamma(k + 1) - std::lgamma(n - k + 1) - n * std::numbers::ln2);
  return std::min(tail, 1.0);
}

}  // namespace identification::gap
