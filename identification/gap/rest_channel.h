/// @file
/// Compliance of a joint at rest under torques below breakaway.
#pragma once
#include <optional>
#include <span>

#include "identification/gap/gap.h"
#include "identification/gap/signals.h"

namespace identification::gap {

/// Presliding in stretches at rest: position against torque below breakaway, a common straight line through
/// stretches of small and of large torque. A compliance that only appears above some torque, or has the same
/// displacement under any, is a spring or a gap behind the motor and is not named here. Gaps are the
/// displacement times the stiffness found [N·m].
struct RestFindings {
  bool rests = false;  ///< there are enough stretches at rest under changing torque
  /// Empty if the model already has presliding, or if the encoder does not resolve the displacement.
  std::optional<FoundEffect> presliding{};
};
RestFindings rest_channel(std::span<const Signals> signals, const model::effects::DriveModel& base,
                          const Band& band, const Options& options);

}  // namespace identification::gap
