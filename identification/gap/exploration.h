/// @file
/// A wide search around a downhill fit.
#pragma once
#include <vector>

#include "identification/gap/fitted_model.h"

namespace identification::gap {

/// refined(), extended for a model with a gap: a gap acts through impacts, and each shift of an impact bends
/// the squared residual, so that a fit ends in one of many local minima. Therefore it starts with the best
/// point of a coarse grid, and searches one direction after another in steps of a quarter, and then in
/// smaller ones, from the best point so far.
FittedModel refined_widely(const FittedModel& fitted, const Rows& rows, const std::vector<Eigen::Index>& use);

}  // namespace identification::gap
