/// @file
/// Which excerpts of very long recordings are analysed.
#pragma once
#include <cstddef>
#include <functional>
#include <span>
#include <vector>

#include "identification/gap/gap.h"
#include "identification/gap/signals.h"

namespace identification::gap {

/// Rows of one recording.
struct Excerpt {
  std::size_t source;  ///< index
  std::size_t from;
  std::size_t to;  ///< one past its last
};

/// Whether a place is there to judge with: of a recording, and the share of its rows that came before.
using Judges = std::function<bool(std::size_t source, double share)>;

/// All recordings as wholes, as long as they are not more than enough. Else they are cut into excerpts of
/// some seconds, and one of every N neighbours is chosen. To search in, that is the one which visits most of
/// what few others visit, of positions, and of torques at a velocity. Where any row is there to judge with,
/// it is one by its number alone, so that what is measured on them is what all rows would give.
std::vector<Excerpt> chosen_excerpts(std::span<const Source> sources, const Band& band, const Judges& judges,
                                     const Enough& enough);

/// Each made ready; those of one recording carry its number and where it begins and ends.
std::vector<Signals> signals_of(std::span<const Source> sources, std::span<const Excerpt> excerpts,
                                const Band& band);

/// What was chosen, for people; none when it is all there is.
std::vector<Diagnosis> left_out(std::span<const Source> sources, std::span<const Excerpt> excerpts);

}  // namespace identification::gap
