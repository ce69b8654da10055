/// @file
/// Which data a gap was measured on, for people.
#pragma once
#include <Eigen/Core>
#include <string>
#include <vector>

#include "identification/gap/prediction.h"

namespace identification::gap {

/// The recordings whose rows judge, by name where all of one is there to judge with: its excerpts or, of each
/// recording, the share of its time `from` to `to`. Only what has rows in `judging` is listed.
std::vector<std::string> held_out_names(const Rows& rows, const std::vector<Eigen::Index>& judging,
                                        double from, double to);

}  // namespace identification::gap
