/// @file
/// Values to try.
#pragma once
#include <cmath>
#include <vector>

namespace identification::gap {

/// From one to the other, both included, each by the same factor above the last.
inline std::vector<double> geometric(double from, double to, int count) {
  std::vector<double> values;
  for (int i = 0; i < count; ++i)
    values.push_back(from * std::pow(to / from, count > 1 ? static_cast<double>(i) / (count - 1) : 0));
  return values;
}

}  // namespace identification::gap
