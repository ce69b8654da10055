/// @file
/// Whether the unexplained residual is noise.
#pragma once
#include <Eigen/Core>
#include <vector>

#include "identification/gap/fitted_model.h"
#include "identification/gap/gap.h"
#include "identification/gap/search.h"

namespace identification::gap {

/// Rows in short stretches with a far larger residual than elsewhere although every column of the library
/// could explain it: an external push, or a slip. Stretches with a reversal are excluded.
std::vector<bool> bursts(const FittedModel& fitted, const Rows& rows);

/// Structure in the residual of a model, whatever its cause.
struct Structure {
  std::vector<Unexplained> held_out;  ///< basis of the verdict
  std::vector<Unexplained> searched;  ///< the same for the fitted rows
};
/// Smooth functions of one coordinate at a time (velocity, acceleration, position, time since reversal,
/// running time), and a cycle in time, that predict the residual better than chance. Each part is predicted
/// in blocks from its other blocks; the held-out rows also from the searched ones, so that a few of them are
/// enough.
Structure structure(const FittedModel& fitted, const Rows& rows, const Training& training,
                    const std::vector<Eigen::Index>& held_out, const Options& options);

}  // namespace identification::gap
