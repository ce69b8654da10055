/// @file
/// Which other names the data would have given, had its noise been dealt otherwise.
#pragma once
#include "identification/gap/gap.h"
#include "identification/gap/search.h"

namespace identification::gap {

/// Puts each rival in the place of the effect that was added, in the final model, and refits: those that win
/// a draw of the noise stay, with their models.
void weigh_rivals(SearchResult& result, const Rows& rows, const Training& training, const Options& options);

}  // namespace identification::gap
