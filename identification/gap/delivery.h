/// @file
/// Selects the part of a search result that is delivered: nothing that is worse on held-out data, and no
/// change that the data do not require.
#pragma once
#include <string>
#include <vector>

#include "identification/gap/confirmation.h"

namespace identification::gap {

/// Compares the torque residual and the free simulation on held-out rows. Removes, the latest first, each
/// effect without which one of them improves by more than its uncertainty; restores the given model's
/// parameters if these are better; and delivers the given model itself if nothing else is as good. Then each
/// parameter of the given model keeps its value unless the data predict significantly better with another. An
/// effect that then removes none of the residual is dropped: of held-out recordings or, if these are
/// stretches of the searched ones, which say less, of those that the search left out in turn. Each remaining
/// effect stores its gain, and the model without it.
/// @returns texts on what was removed and why.
std::vector<std::string> deliver(SearchResult& result, const FittedModel& given, const Judged& judged);

/// The delivered model with a presliding that is visible at rest, which gives its stiffness; its damping is
/// fitted to the motion. `worse_at` is not empty if the held-out data are predicted or simulated worse with
/// it.
struct WithPresliding {
  FittedModel model;
  std::string worse_at;
};
WithPresliding with_presliding(const FittedModel& delivered, const model::effects::AnyEffect& presliding,
                               const Judged& judged);

/// The delivered model, refitted to the set-points of the searched recordings, if the servo follows those of
/// the held-out ones significantly better with it, and nothing else becomes worse; otherwise as it is.
FittedModel fitted_to_servo(const FittedModel& delivered, const std::vector<ServoRun>& searched,
                            const Judged& judged);

/// Two models on the held-out rows.
struct HeldOutComparison {
  double gain = 0;  ///< share of the squared torque residual that the candidate removes
  double decisiveness = 0;
  int blocks_improved = 0;
  int blocks = 0;
  double before_Nm = 0;  ///< rms torque residual
  double after_Nm = 0;
  double simulation_before_rad_per_s = 0;  ///< rms velocity error of free simulation in windows
  double simulation_after_rad_per_s = 0;
  std::string worse_at{};  ///< not empty if the candidate predicts or simulates them worse
};
HeldOutComparison compared(const FittedModel& than, const FittedModel& candidate, const Judged& judged);

}  // namespace identification::gap
