/// @file
/// What a model leaves that no effect of the library explains, as a torque without a physical name.
#pragma once
#include <optional>

#include "identification/gap/confirmation.h"
#include "identification/gap/fitted_model.h"
#include "identification/gap/gap.h"

namespace identification::gap {

/// Sparse additive regression of the residual of `delivered`, whose own parameters stay. The basis is a table
/// of a few resolutions for each term of model::effects::Empirical: over velocity; over position or turn, as
/// it is, times the direction and times the velocity; over the load and over the time since reversal, times
/// the direction; and over velocity times the load. The term that predicts the left-out blocks best is added
/// as long as its gain exceeds both the least gain of a named effect and what all terms gain by chance; terms
/// that later ones make superfluous are removed. Held-out rows, which no fit has seen, decide: without a
/// significant gain there, or with a worse free simulation, the latest term is taken back.
/// [forward selection of groups; block cross-validation as in search.h]
/// Empty if nothing remains.
std::optional<UnnamedEffect> find_unnamed(const FittedModel& delivered, const Judged& judged,
                                          const Options& options);

}  // namespace identification::gap
