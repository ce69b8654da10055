/// @file
/// Removes points of a long series that are not visible on any screen.
#pragma once
#include <cstddef>
#include <span>
#include <vector>

namespace report {

/// Up to here every point is kept.
inline constexpr std::size_t kKeepAll = 4000;
/// Maximum, whatever the series.
inline constexpr std::size_t kKeepAtMost = 20000;
/// More than any plot is wide in pixels.
inline constexpr int kColumns = 2000;

/// Equally long; lower and upper equal y if there is no band. Non-finite values are gaps.
struct Points {
  std::span<const double> x;
  std::span<const double> lower;
  std::span<const double> upper;
  bool x_log = false;
  bool y_log = false;
};

/// Indices, in order, of the points that a line needs: in each stretch within one pixel column the first, the
/// last, the lowest and the highest, and one point of each gap. A later return to a column (a loop) is
/// another stretch.
std::vector<std::size_t> needed_for_line(const Points& points);

/// Indices, in order, of points of which no two share a cell of a fine grid.
std::vector<std::size_t> needed_for_markers(const Points& points);

}  // namespace report
