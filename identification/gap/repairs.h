/// @file
/// Repairs of recordings that need no guess: each function repairs one kind of damage and reports it.
#pragma once
#include <cstddef>
#include <set>
#include <vector>

#include "identification/gap/gap.h"

namespace identification::gap {

using Diagnoses = std::vector<Diagnosis>;

/// Times of a clock that started years ago count from the first row: of seconds since 1970, texts with few
/// digits show only the years.
void count_from_first_row(Source& source, Diagnoses& diagnoses);

/// Removes a torque column that is constant while its command changes, a position that is constant while the
/// velocity is not zero, and the reverse.
/// @throws std::invalid_argument if no torque is left.
void drop_dead_columns(Source& source, Diagnoses& diagnoses);

/// Removes rows in which the measured torque is held far longer than elsewhere, while its command changes or,
/// without one, the joint turns. At the end of the sensor's range that is saturation.
void drop_held_torque(Source& source, Diagnoses& diagnoses);

/// A position whose jumps span its whole range, against the motion, is of an encoder that counts within one
/// turn of its own shaft: the turns are counted on. Three jumps or more, none of them over a hole in time.
/// Single jumps of a whole turn are unwrapped, too. position_command_rad follows.
void unwrap_position(Source& source, Diagnoses& diagnoses);

/// Interpolates single outliers of position.
/// @returns the rows before which the position has another jump.
std::set<std::size_t> mend_position(Source& source, Diagnoses& diagnoses);

/// At most three consecutive rows, and one in a hundred in total, whose torque is far beyond all others and
/// returns to where it was. It is no spike if the command has it, too, or the motion answers it.
void interpolate_torque_spikes(Source& source, Diagnoses& diagnoses);

/// Adds the column kSaturated, 1 where the measured torque stays at the end of its sensor's range and 0
/// elsewhere: the actual torque was larger there.
void mark_saturation(Source& source, Diagnoses& diagnoses);

/// If a sensor repeats its value for several rows and then jumps, only its fresh values are kept.
/// @returns the kept rows; all if nothing is held.
std::vector<std::size_t> fresh_rows(const Source& source, Diagnoses& diagnoses);

/// Only these rows.
Source with_rows(Source source, const std::vector<std::size_t>& rows);

/// Parts between `cuts`, gaps in time and changes of its rate, without those that are too short to be useful.
/// @throws std::invalid_argument if none is left.
std::vector<Source> divided(Source source, const std::set<std::size_t>& cuts, Diagnoses& diagnoses);

}  // namespace identification::gap
