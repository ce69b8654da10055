/// @file
/// Which part of what a search found is delivered: nothing that does worse on held-out data, and no change
/// that the data do not ask for.
#pragma once
#include <string>
#include <vector>

#include "identification/gap/confirmation.h"

namespace identification::gap {

/// Compares on held-out rows the torque residual and the free simulation. Takes away, the latest first, each
/// effect without which one of them is better by more than its uncertainty; gives the given model's
/// parameters their values back when these do better; and delivers the given model itself when nothing else
/// is as good. Then each parameter of the given model keeps its value unless the data predict surely better
/// with another. An effect that then takes away nothing leaves, too: of held-out recordings or, where these
/// are stretches of the searched ones, which say less, of those that the search left out in turn. What stays
/// knows how much that is, and the model without it.
/// @returns for people, what was taken back and why.
std::vector<std::string> deliver(SearchResult& result, const FittedModel& given, const Judged& judged);

/// The delivered model with a presliding that shows at rest, which gives its stiffness; its damping is fitted
/// to the motion. `worse_at` is not empty when the held-out data are predicted or simulated worse with it.
struct WithPresliding {
  FittedModel model;
  std::string worse_at;
};
WithPresliding with_presliding(const FittedModel& delivered, const model::effects::AnyEffect& presliding,
                               const Judged& judged);

}  // namespace identification::gap
