#include "model/friction/sliding_table.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>

#include "model/friction/wheel_curve.h"

namespace model::friction {
namespace {

std::vector<double> sample_branch(const std::function<double(double)>& law_Nm, double sign,
                                  const SlidingTable::Grid& grid, std::size_t intervals) {
  std::vector<double> level(intervals + 1);
  for (std::size_t i = 0; i <= intervals; ++i) {
    const double velocity = sign * static_cast<double>(i) * grid.spacing_rad_per_s;
    level[i] = std::abs(law_Nm(velocity));
    if (!std::isfinite(level[i]))
      throw std::invalid_argument("friction table: the law is not finite at " + std::to_string(velocity) +
                                  " rad/s");
  }
  const auto in_band =
      std::min(intervals, static_cast<std::size_t>(grid.breakaway_band_rad_per_s / grid.spacing_rad_per_s));
  const auto peak = std::max_element(level.begin(), level.begin() + static_cast<std::ptrdiff_t>(in_band) + 1);
  std::fill(level.begin(), peak, *peak);
  return level;
}

}  // namespace

SlidingTable::SlidingTable(const std::function<double(double)>& law_Nm, const Grid& grid)
    : inverse_spacing_(1 / grid.spacing_rad_per_s) {
  const double intervals = std::round(grid.top_speed_rad_per_s / grid.spacing_rad_per_s);
  const double missed = std::abs(intervals * grid.spacing_rad_per_s - grid.top_speed_rad_per_s);
  if (!(grid.spacing_rad_per_s > 0 && intervals >= 1 && intervals <= 1e6 &&
        missed < 1e-6 * grid.top_speed_rad_per_s))
    throw std::invalid_argument("friction table: spacing " + std::to_string(grid.spacing_rad_per_s) +
                                " rad/s does not divide a top speed of " +
                                std::to_string(grid.top_speed_rad_per_s) + " rad/s into 1 to 1e6 intervals");
  if (!(std::isfinite(grid.breakaway_band_rad_per_s) && grid.breakaway_band_rad_per_s >= 0))
    throw std::invalid_argument("friction table: the break-away band must be finite and not negative");
  last_ = intervals;
  forward_ = sample_branch(law_Nm, 1.0, grid, static_cast<std::size_t>(intervals));
  backward_ = sample_branch(law_Nm, -1.0, grid, static_cast<std::size_t>(intervals));
}

double SlidingTable::breakaway_Nm(double direction) const noexcept {
  return std::signbit(direction) ? backward_.front() : forward_.front();
}

SlidingTable SlidingTable::scaled(double factor) const {
  SlidingTable result = *this;
  for (double& level : result.forward_) level *= factor;
  for (double& level : result.backward_) level *= factor;
  return result;
}

SlidingTable wheel_table(int wheel, const SlidingTable::Grid& grid) {
  return {[wheel](double velocity) { return wheel_curve_Nm(wheel, velocity); }, grid};
}

}  // namespace model::friction
