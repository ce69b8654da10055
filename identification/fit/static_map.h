/// @file
/// A steady-state friction map: the torque that holds a joint at each of several constant velocities.
#pragma once
#include <limits>
#include <span>
#include <string>
#include <vector>

#include "identification/recording.h"

namespace identification::fit {

inline constexpr const char* kStaticMapExperiment = "steady-state-map";

struct MapPoint {
  double velocity_rad_per_s = 0;
  double torque_Nm =
      0;  ///< of friction: positive against positive motion; at constant velocity equal to the motor's
  double torque_ci95_Nm = 0;  ///< half the 95 % interval of the mean, from repeats; 0: unknown
};
struct StaticMap {
  std::string rig;
  std::vector<MapPoint> points;  ///< any order, repeats allowed
};

/// From recordings of the experiment steady-state-map, one row per measured speed: velocity_rad_per_s,
/// torque_measured_Nm and, if present, torque_ci95_Nm. Rows without velocity or torque (NaN) were not
/// measured and are skipped. Several recordings of one rig make one map.
/// @throws std::invalid_argument for another experiment, mixed rigs, missing columns, a negative interval or
/// a row at rest, where friction is undefined.
StaticMap static_map(std::span<const Recording> recordings);

/// Speeds of a map, in either direction, that a fit uses: those from `above` to `below`; if `below` is the
/// smaller one, those up to it and those from `above` on, without the range between.
struct SpeedRange {
  double above_rad_per_s = 0;
  double below_rad_per_s = std::numeric_limits<double>::infinity();
  bool holds(double velocity_rad_per_s) const noexcept;
};
/// Removes the points outside of `range` from `map` and returns them in order.
std::vector<MapPoint> leave_out(StaticMap& map, const SpeedRange& range);

/// The points by measured velocity, grouped if closer than 0.5 % of their speed. Indices into map.points,
/// groups in ascending velocity.
std::vector<std::vector<std::size_t>> speeds_of(const StaticMap& map);

}  // namespace identification::fit
