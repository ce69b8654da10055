/// @file
/// The sample period of an evenly sampled recording.
#pragma once
#include "identification/recording.h"

namespace identification::fit {

/// The median of the steps of time_s [s]. @throws std::invalid_argument if there are fewer than 100 rows or
/// more than one step in a hundred differs by more than half a period: a gap, or uneven sampling.
double even_period_s(const Recording& recording);

}  // namespace identification::fit
