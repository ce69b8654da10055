#include "identification/fit/static_map.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <stdexcept>

namespace identification::fit {
namespace {

[[noreturn]] void refuse(const Recording& recording, const std::string& why) {
  throw std::invalid_argument("steady-state map of " +
                              (recording.rig.empty() ? std::string("an unnamed rig") : recording.rig) + ": " +
                              why);
}

}  // namespace

StaticMap static_map(std::span<const Recording> recordings) {
  if (recordings.empty()) throw std::invalid_argument("steady-state map: no recording was given");
  StaticMap map{recordings.front().rig, {}};
  for (const Recording& recording : recordings) {
    if (recording.experiment != kStaticMapExperiment)
      refuse(recording, "the recording is of experiment '" + recording.experiment + "', not '" +
                            kStaticMapExperiment + "'");
    if (recording.rig != map.rig)
      refuse(recording, "another recording is of rig '" + map.rig + "'; fit one rig at a time");
    const auto velocity = recording.column("velocity_rad_per_s");
    const auto torque = recording.column("torque_measured_Nm");
    const auto ci95 =
        recording.has("torque_ci95_Nm") ? recording.column("torque_ci95_Nm") : std::span<const double>();
    for (std::size_t i = 0; i < velocity.size(); ++i) {
      if (std::isnan(velocity[i]) || std::isnan(torque[i])) continue;
      const std::string row = "data row " + std::to_string(i + 1);
      if (velocity[i] == 0) refuse(recording, row + " is at rest; a map holds moving points only");
      if (!ci95.empty() && ci95[i] < 0) refuse(recording, row + " has a negative torque_ci95_Nm");
      map.points.push_back({velocity[i], torque[i], ci95.empty() || std::isnan(ci95[i]) ? 0.0 : ci95[i]});
    }
  }
  return map;
}

bool SpeedRange::holds(double velocity_rad_per_s) const noexcept {
  const double speed = std::abs(velocity_rad_per_s);
  const bool fast_enough = speed >= above_rad_per_s;
  const bool slow_enough = speed <= below_rad_per_s;
  return below_rad_per_s < above_rad_per_s ? fast_enough || slow_enough : fast_enough && slow_enough;
}

std::vector<MapPoint> leave_out(StaticMap& map, const SpeedRange& range) {
  const auto outside =
      std::stable_partition(map.points.begin(), map.points.end(),
                            [&](const MapPoint& point) { return range.holds(point.velocity_rad_per_s); });
  std::vector<MapPoint> left_out(outside, map.points.end());
  map.points.erase(outside, map.points.end());
  return left_out;
}

std::vector<std::vector<std::size_t>> speeds_of(const StaticMap& map) {
  std::vector<std::size_t> order(map.points.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  const auto velocity = [&map](std::size_t i) { return map.points[i].velocity_rad_per_s; };
  std::stable_sort(order.begin(), order.end(),
                   [&](std::size_t a, std::size_t b) { return velocity(a) < velocity(b); });
  std::vector<std::vector<std::size_t>> groups;
  for (const std::size_t i : order) {
    if (groups.empty() ||
        velocity(i) - velocity(groups.back().front()) > 0.005 * std::abs(velocity(groups.back().front())))
      groups.emplace_back();
    groups.back().push_back(i);
  }
  return groups;
}

}  // namespace identification::fit
