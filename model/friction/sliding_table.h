/// @file
/// Friction level against velocity, as a table with constant look-up time that is continuous everywhere.
#pragma once
#include <cmath>
#include <cstddef>
#include <functional>
#include <vector>

namespace model::friction {

/// Magnitude of the friction torque of a sliding joint, one branch per direction. It differs from its law in
/// three ways:
/// - straight lines between samples `spacing` apart, so a jump of the law is crossed within one spacing;
/// - at rest it is the breakaway torque: the law's peak below `breakaway_band` is held from its speed down to
///   standstill, where published curves fall to zero because they cannot stick;
/// - beyond `top_speed` the value at that speed is held.
/// Immutable after construction; look-ups are cycle-safe.
class SlidingTable {
 public:
  struct Grid {
    double spacing_rad_per_s = 0.02;
    double top_speed_rad_per_s = 10.0;
    double breakaway_band_rad_per_s = 0.3;
  };
  /// Samples |law(velocity)|. @throws std::invalid_argument if the grid is invalid or a sample is not finite.
  SlidingTable(const std::function<double(double velocity_rad_per_s)>& law_Nm, const Grid& grid);

  /// Never negative. The sign of `velocity_rad_per_s` (also of zero) selects the branch.
  double level_Nm(double velocity_rad_per_s) const noexcept {
    const std::vector<double>& branch = std::signbit(velocity_rad_per_s) ? backward_ : forward_;
    const double position = std::abs(velocity_rad_per_s) * inverse_spacing_;
    if (!(position < last_)) return branch.back();  // also taken for NaN
    const auto below = static_cast<std::size_t>(position);
    const double fraction = position - static_cast<double>(below);
    return branch[below] + fraction * (branch[below + 1] - branch[below]);
  }
  /// The level at rest for a motion in the direction of `direction`.
  double breakaway_Nm(double direction) const noexcept;

  /// The same friction, `factor` times as strong.
  SlidingTable scaled(double factor) const;

 private:
  double inverse_spacing_;
  double last_;  // highest position on the grid, in spacings
  std::vector<double> forward_;
  std::vector<double> backward_;
};

/// The four measured wheel curves as tables.
SlidingTable wheel_table(int wheel, const SlidingTable::Grid& grid = {});

}  // namespace model::friction
