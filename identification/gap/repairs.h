/// @file
/// Damage in a recording that can be mended without a guess: each function mends one kind and says so.
#pragma once
#include <cstddef>
#include <set>
#include <vector>

#include "identification/gap/gap.h"

namespace identification::gap {

using Diagnoses = std::vector<Diagnosis>;

/// A torque that is measured as the same number in each row while its command changes, a position that stands
/// while the velocity is not zero, and the reverse: the column goes.
/// @throws std::invalid_argument when no torque is left.
void drop_dead_columns(Source& source, Diagnoses& diagnoses);

/// Rows go in which the measured torque is held far longer than elsewhere, while its command changes or,
/// without one, the joint turns. At the end of the sensor's range that is saturation.
void drop_held_torque(Source& source, Diagnoses& diagnoses);

/// Jumps of a whole turn are unwrapped; single positions off the way are interpolated.
/// @returns the rows before which the position jumps otherwise.
std::set<std::size_t> mend_position(Source& source, Diagnoses& diagnoses);

/// At most three rows in a row, and one in a hundred in all, whose torque is far beyond all others.
void interpolate_torque_spikes(Source& source, Diagnoses& diagnoses);

/// Adds the column kSaturated, 1 where the measured torque stays at the end of its sensor's range and 0
/// elsewhere: more of it acted there than was measured.
void mark_saturation(Source& source, Diagnoses& diagnoses);

/// Where a sensor gives the same value for several rows and then jumps, its fresh values alone are kept.
/// @returns the kept rows; all, when nothing is held.
std::vector<std::size_t> fresh_rows(const Source& source, Diagnoses& diagnoses);

/// Only these rows.
Source with_rows(Source source, const std::vector<std::size_t>& rows);

/// Parts between `cuts` and holes in time, those that are too short to say anything left out.
/// @throws std::invalid_argument when none is left.
std::vector<Source> divided(Source source, const std::set<std::size_t>& cuts, Diagnoses& diagnoses);

}  // namespace identification::gap
