/// @file
/// A torque sensor that reports magnitude only, as a current sensor before a rectifier does.
#pragma once
#include <cstddef>
#include <optional>
#include <vector>

#include "identification/gap/gap.h"

namespace identification::gap {

struct LostSign {
  std::vector<Source>
      sources;  ///< with the sign put back: that of the command, or of the velocity without one
  std::optional<FoundEffect> found;  ///< unless the given model has it already
};

/// Whether the measured torque is a magnitude: hardly ever negative although command or motion go both ways,
/// and the command, or without one the given model, refitted, agrees with the torque better once the sign is
/// put back, in more of the blocks of the first `data` recordings than chance lets it. A model that says so
/// itself is believed.
std::optional<LostSign> lost_sign(const std::vector<Source>& sources, std::size_t data,
                                  const model::effects::DriveModel& base, const Options& options);

}  // namespace identification::gap
