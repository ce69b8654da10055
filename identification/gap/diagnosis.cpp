#include "identification/gap/diagnosis.h"

#include <algorithm>
#include <cstddef>
#include <set>
#include <utility>

#include "identification/gap/repairs.h"
#include "identification/gap/units.h"

namespace identification::gap {
namespace {

/// Converts cuts in rows of a recording to its remaining rows.
std::set<std::size_t> among(const std::vector<std::size_t>& rows, const std::set<std::size_t>& cuts) {
  std::set<std::size_t> result;
  for (const std::size_t cut : cuts) {
    const auto at = std::ranges::lower_bound(rows, cut) - rows.begin();
    result.insert(static_cast<std::size_t>(at));
  }
  return result;
}

/// Removes rows in which a sensor only repeats its value. @returns `cuts` among the remaining rows.
std::set<std::size_t> keep_fresh_rows(Source& source, const std::set<std::size_t>& cuts,
                                      std::vector<Diagnosis>& diagnosis) {
  const std::vector<std::size_t> rows = fresh_rows(source, diagnosis);
  if (rows.size() < source.recording.rows()) source = with_rows(std::move(source), rows);
  return among(rows, cuts);
}

}  // namespace

void unwrap_positions(std::vector<Source>& sources, std::vector<Diagnosis>& diagnosis) {
  for (Source& source : sources) unwrap_position(source, diagnosis);
}

Diagnosed diagnose(std::vector<Source> sources, const model::effects::DriveModel& base) {
  Diagnosed result;
  for (Source& source : sources) {
    count_from_first_row(source, result.diagnosis);
    drop_dead_columns(source, result.diagnosis);
    drop_held_torque(source, result.diagnosis);
    unwrap_position(source, result.diagnosis);
    const std::set<std::size_t> jumps = mend_position(source, result.diagnosis);
    interpolate_torque_spikes(source, result.diagnosis);
    mark_saturation(source, result.diagnosis);
    const std::set<std::size_t> cuts = keep_fresh_rows(source, jumps, result.diagnosis);
    for (Source& part : divided(std::move(source), cuts, result.diagnosis)) {
      check_units(part, base, result.diagnosis);
      result.sources.push_back(std::move(part));
    }
  }
  return result;
}

}  // namespace identification::gap
