/// @file
/// How far a joint at rest gives under torques that do not break it away.
#pragma once
#include <optional>
#include <span>

#include "identification/gap/gap.h"
#include "identification/gap/signals.h"

namespace identification::gap {

/// Presliding in stretches at rest: position against torque below break-away, a straight line through
/// stretches of little and of much torque alike. What gives way only above some torque, or by the same
/// distance under any, is a spring or a gap behind the motor and is not named here. Gaps are the displacement
/// times the stiffness found [N·m].
struct RestFindings {
  bool rests = false;  ///< something rests under changing torque, often enough to tell
  /// Empty where the model has presliding already, or where the encoder does not resolve what it gives.
  std::optional<FoundEffect> presliding{};
};
RestFindings rest_channel(std::span<const Signals> signals, const model::effects::DriveModel& base,
                          const Band& band, const Options& options);

}  // namespace identification::gap
