/// @file
/// Statistics of a feature, as meta/stats.json of a LeRobot dataset has them.
#pragma once
#include <cstddef>
#include <span>
#include <string>
#include <utility>
#include <vector>

namespace youbotctl {

/// Each with one number for each dimension: min, max, mean, std, count, q01, q10, q50, q90, q99.
///
/// std is that of all values (divided by their number). A quantile q is the value of rank ⌈q·count⌉. LeRobot
/// estimates it from 5000 bins, to within a 5000th of the range; over several episodes, it takes the lowest
/// of their q01, q10, q50 and the highest of their q90, q99, because it has no longer the data. Here the
/// quantile is that of all data.
using Statistics = std::vector<std::pair<std::string, std::vector<double>>>;

/// Of `values`, frame by frame, with `width` dimensions each. At least one frame.
Statistics statistics(std::span<const double> values, std::size_t width);

}  // namespace youbotctl
