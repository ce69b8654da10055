/// @file
/// A look at recordings before anything is explained with them: what is damaged is mended or cut, and what
/// contradicts itself is refused.
#pragma once
#include <vector>

#include "identification/gap/gap.h"

namespace identification::gap {

struct Diagnosed {
  std::vector<Source> sources;  ///< mended; one recording may have become several, or none
  std::vector<Diagnosis> diagnosis;
};

/// Wrapped positions are unwrapped. Jumps of position and long holes in time divide a recording. Single
/// torques far beyond all others are interpolated, of held values only the fresh ones are kept, and a dead
/// column is removed when another one says the same. Units and signs are judged by what columns say of each
/// other, and by the inertia and friction that they imply beside those of `base`.
/// @throws std::invalid_argument naming recording, column, likely cause and remedy, where one of these cannot
///         be mended without a guess.
Diagnosed diagnose(std::vector<Source> sources, const model::effects::DriveModel& base);

}  // namespace identification::gap
