/// @file
/// Other effects that the data would have selected with other noise.
#pragma once
#include "identification/gap/gap.h"
#include "identification/gap/search.h"

namespace identification::gap {

/// Substitutes each rival for the added effect in the final model, and refits: those that win a draw of the
/// noise are kept, with their models.
void weigh_rivals(SearchResult& result, const Rows& rows, const Training& training, const Options& options);

}  // namespace identification::gap
