/// @file
/// A wide search around a fit that only goes downhill.
#pragma once
#include <vector>

#include "identification/gap/fitted_model.h"

namespace identification::gap {

/// refined(), and for a model with a gap more: a gap counts in impacts, and each that comes earlier or later
/// bends the squared residual, so that a fit ends in one of many small valleys. So it begins with the best of
/// a coarse grid, and goes along one direction after another in steps of a quarter, and then in smaller ones,
/// from whatever is best so far.
FittedModel refined_widely(const FittedModel& fitted, const Rows& rows, const std::vector<Eigen::Index>& use);

}  // namespace identification::gap
