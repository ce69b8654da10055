/// @file
/// Quantiles of samples.
#pragma once
#include <algorithm>
#include <cstddef>
#include <vector>

namespace identification::fit {

/// The value below which a share (0 to 1) of the values lies, one of them; 0 without values.
inline double quantile(std::vector<double> values, double share) {
  if (values.empty()) return 0;
  const auto at =
      values.begin() + static_cast<std::ptrdiff_t>(share * static_cast<double>(values.size() - 1));
  std::ranges::nth_element(values, at);
  return *at;
}

}  // namespace identification::fit
