#include "report/decimate.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

namespace report {
namespace {

double scaled(double value, bool log) {
  if (!log) return value;
  return value > 0 ? std::log10(value) : std::numeric_limits<double>::quiet_NaN();
}

/// Divides the range of the finite values evenly on the axis.
class Cells {
 public:
  Cells(std::span<const double> values, bool log) : log_(log) {
    double to = -std::numeric_limits<double>::infinity();
    from_ = -to;
    for (const double raw : values) {
      const double value = scaled(raw, log);
      if (!std::isfinite(value)) continue;
      from_ = std::min(from_, value);
      to = std::max(to, value);
    }
    // Halved, because the difference of two finite numbers may be infinite.
    half_range_ = to > from_ ? to / 2 - from_ / 2 : 1;
  }
  int of(double value, int count) const {
    const double share = (scaled(value, log_) / 2 - from_ / 2) / half_range_;
    return std::min(count - 1, static_cast<int>(share * count));
  }

 private:
  bool log_;
  double from_ = 0;
  double half_range_ = 1;
};

bool is_drawn(const Points& points, std::size_t i) {
  return std::isfinite(scaled(points.x[i], points.x_log)) && std::isfinite(points.lower[i]) &&
         std::isfinite(scaled(points.upper[i], points.y_log));
}

/// Outlines the points [first, last] by up to six of them, appended in order.
void append_extremes(const Points& points, std::size_t first, std::size_t last, bool in_x_too,
                     std::vector<std::size_t>& kept) {
  std::size_t lowest = first, highest = first, leftmost = first, rightmost = first;
  for (std::size_t i = first; i <= last; ++i) {
    if (points.lower[i] < points.lower[lowest]) lowest = i;
    if (points.upper[i] > points.upper[highest]) highest = i;
    if (in_x_too && points.x[i] < points.x[leftmost]) leftmost = i;
    if (in_x_too && points.x[i] > points.x[rightmost]) rightmost = i;
  }
  const auto begin = static_cast<std::ptrdiff_t>(kept.size());
  kept.insert(kept.end(), {first, lowest, highest, leftmost, rightmost, last});
  std::sort(kept.begin() + begin, kept.end());
  kept.erase(std::unique(kept.begin() + begin, kept.end()), kept.end());
}

/// Splits the series into stretches that `together(first, i)` holds together, gaps apart.
template <typename Together>
std::vector<std::size_t> outlined(const Points& points, bool in_x_too, Together together) {
  std::vector<std::size_t> kept;
  bool in_gap = false;
  for (std::size_t first = 0; first < points.x.size();) {
    if (!is_drawn(points, first)) {
      if (!in_gap) kept.push_back(first);
      in_gap = true;
      ++first;
      continue;
    }
    in_gap = false;
    std::size_t last = first;
    while (last + 1 < points.x.size() && is_drawn(points, last + 1) && together(first, last + 1)) ++last;
    append_extremes(points, first, last, in_x_too, kept);
    first = last + 1;
  }
  return kept;
}

std::vector<std::size_t> all(const Points& points) {
  std::vector<std::size_t> indices(points.x.size());
  std::iota(indices.begin(), indices.end(), std::size_t{0});
  return indices;
}

}  // namespace

std::vector<std::size_t> needed_for_line(const Points& points) {
  if (points.x.size() <= kKeepAll) return all(points);
  const Cells cells(points.x, points.x_log);
  const auto column = [&](std::size_t i) { return cells.of(points.x[i], kColumns); };
  auto kept = outlined(points, false, [&](std::size_t a, std::size_t b) { return column(a) == column(b); });
  // Many rounds of a loop, or noisy x: outlines blocks of consecutive points in both directions.
  for (std::size_t block = 8; kept.size() > kKeepAtMost && block < points.x.size(); block *= 2)
    kept = outlined(points, true, [block](std::size_t a, std::size_t b) { return a / block == b / block; });
  if (kept.size() > kKeepAtMost) kept.resize(kKeepAtMost);  // only gaps
  return kept;
}

std::vector<std::size_t> needed_for_markers(const Points& points) {
  if (points.x.size() <= kKeepAll) return all(points);
  const Cells columns(points.x, points.x_log);
  const Cells rows(points.upper, points.y_log);
  std::vector<std::size_t> kept;
  for (int count = kColumns; count >= 1; count /= 2) {
    kept.clear();
    std::vector<bool> taken(static_cast<std::size_t>(count) * static_cast<std::size_t>(count));
    for (std::size_t i = 0; i < points.x.size(); ++i) {
      if (!is_drawn(points, i)) continue;
      const auto cell =
          static_cast<std::size_t>(rows.of(points.upper[i], count)) * static_cast<std::size_t>(count) +
          static_cast<std::size_t>(columns.of(points.x[i], count));
      if (taken[cell]) continue;
      taken[cell] = true;
      kept.push_back(i);
    }
    if (kept.size() <= kKeepAtMost) break;
  }
  return kept;
}

}  // namespace report
