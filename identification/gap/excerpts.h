/// @file
/// Selects the excerpts of very long recordings that are analysed.
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

/// Whether a position, given as recording and share of its preceding time, belongs to the held-out data.
using Judges = std::function<bool(std::size_t source, double share)>;

/// Whole recordings, if they are not longer than necessary. Otherwise they are cut into excerpts of some
/// seconds, and one of every N neighbours is selected. For the search it is the one with most of the rarely
/// visited positions, and torques at a velocity. If any row is held out, it is selected by its number only,
/// so that the excerpts are representative of all rows.
std::vector<Excerpt> chosen_excerpts(std::span<const Source> sources, const Band& band, const Judges& judges,
                                     const Enough& enough);

/// Prepared signals of each; those of one recording carry its number and their start and end.
std::vector<Signals> signals_of(std::span<const Source> sources, std::span<const Excerpt> excerpts,
                                const Band& band);

/// Texts on what was selected; empty if everything was.
std::vector<Diagnosis> left_out(std::span<const Source> sources, std::span<const Excerpt> excerpts);

}  // namespace identification::gap
