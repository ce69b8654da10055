/// @file
/// Whether one model is better than another in most parts of the data, or only by chance in a few.
#pragma once
#include <cmath>
#include <cstddef>
#include <span>

namespace identification::gap {

/// Mean over standard error of the differences between the squares of two models, block by block: above 2,
/// `worse` is significantly worse than `better`. 0 for fewer than two blocks and for no difference; infinite
/// if a square of only `worse` is not finite.
inline double decisiveness(std::span<const double> worse, std::span<const double> better) {
  const auto n = static_cast<double>(worse.size());
  double sum = 0;
  double square = 0;
  for (std::size_t b = 0; b < worse.size(); ++b) {
    const double d = worse[b] - better[b];
    sum += d;
    square += d * d;
  }
  if (std::isinf(sum)) return sum;
  const double variance = (square - sum * sum / n) / (n - 1);
  return variance > 0 ? sum / n / std::sqrt(variance / n) : 0;
}

}  // namespace identification::gap
