/// @file
/// Whether a named effect has the shape of what it removes.
#pragma once
#include "identification/gap/confirmation.h"

namespace identification::gap {

/// Removes, the latest first, each addition that removes less than most of what a free table over its own
/// coordinate (velocity, position, load) removes in its place: a cause with another shape over the same
/// coordinate makes it useful, and does not bear its name. Both are judged on the blocks that a fit left out.
/// Refits the rest.
void drop_misshapen(SearchResult& result, const Judged& judged);

}  // namespace identification::gap
