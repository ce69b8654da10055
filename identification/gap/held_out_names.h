/// @file
/// Names of the data on which a gap was measured, for reports.
#pragma once
#include <Eigen/Core>
#include <string>
#include <vector>

#include "identification/gap/prediction.h"

namespace identification::gap {

/// The held-out recordings, by name if all of one is held out; otherwise its excerpts or, for each recording,
/// the share of its time `from` to `to`. Lists only those with rows in `judging`.
std::vector<std::string> held_out_names(const Rows& rows, const std::vector<Eigen::Index>& judging,
                                        double from, double to);

}  // namespace identification::gap
