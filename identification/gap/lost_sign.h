/// @file
/// A torque sensor that reports magnitude only, like a current sensor before a rectifier.
#pragma once
#include <cstddef>
#include <optional>
#include <vector>

#include "identification/gap/gap.h"

namespace identification::gap {

struct LostSign {
  std::vector<Source>
      sources;  ///< with the sign restored: that of the command, or of the velocity without one
  std::optional<FoundEffect> found;  ///< unless it is already in the given model
};

/// Whether the measured torque is a magnitude: hardly ever negative although command or motion have both
/// signs, and the command, or without one the refitted given model, agrees better with the torque after the
/// sign is restored, in significantly many blocks of the first `data` recordings. If the given model itself
/// says so, it is trusted.
std::optional<LostSign> lost_sign(const std::vector<Source>& sources, std::size_t data,
                                  const model::effects::DriveModel& base, const Options& options);

}  // namespace identification::gap
