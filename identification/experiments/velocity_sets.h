/// @file
/// The velocities at which friction is measured (thesis 2.5.1, table 3).
#pragma once
#include <array>
#include <string_view>
#include <vector>

namespace identification::experiments {

struct VelocitySet {
  double from_rad_per_s;
  double to_rad_per_s;
  double step_rad_per_s;
  int measurements;
};

/// As printed. Each set ends at `to` and begins one step after `from`, which gives the printed number of
/// measurements, except for the last: 13 measurements that end at −10 begin at −4.0, within the range of the
/// previous set. The number is kept.
inline constexpr std::array<VelocitySet, 9> kTable3{{{0, 0.5, 0.05, 10},
                                                     {0, 0.5, 0.005, 100},
                                                     {0.5, 0.75, 0.005, 50},
                                                     {0.75, 2, 0.05, 25},
                                                     {0.7, 4, 0.1, 33},
                                                     {2, 10, 0.5, 16},
                                                     {0, -1.5, 0.05, 30},
                                                     {-1, -4.5, 0.1, 35},
                                                     {-4.5, -10, 0.5, 13}}};

/// Velocities of one set, in the order from `from` to `to`.
std::vector<double> velocities_rad_per_s(const VelocitySet& set);

/// Velocities of the sets listed in `sets`, "1,3,9" or "1-9", counted from 1, one set after the other.
/// @throws std::invalid_argument if the text is not such a list or names an unknown set.
std::vector<double> velocities_rad_per_s(std::string_view sets);

}  // namespace identification::experiments
