/// @file
/// Whether what no effect explains is noise.
#pragma once
#include <Eigen/Core>
#include <vector>

#include "identification/gap/fitted_model.h"
#include "identification/gap/gap.h"
#include "identification/gap/search.h"

namespace identification::gap {

/// Rows in short stretches where far more is left over than elsewhere although every column of the library
/// was free to explain it: somebody pushed, something slipped. Stretches with a reversal in them do not
/// count.
std::vector<bool> bursts(const FittedModel& fitted, const Rows& rows);

/// Structure that is there, whatever its cause, in what a model leaves.
struct Structure {
  std::vector<Unexplained> held_out;  ///< what the verdict is of
  std::vector<Unexplained> searched;  ///< the same of the rows that the model was fitted to
};
/// Smooth functions of one coordinate at a time (velocity, acceleration, position, time since reversal,
/// running time), and a cycle in time, that predict the residual better than chance. Each part is predicted
/// in blocks from its other blocks; the held-out rows also by what the searched ones give, so that a few of
/// them are enough to judge.
Structure structure(const FittedModel& fitted, const Rows& rows, const Training& training,
                    const std::vector<Eigen::Index>& held_out, const Options& options);

/// Seconds since the velocity last changed sign, at each sample.
std::vector<double> since_reversal_s(const Signals& signals);

}  // namespace identification::gap
