/// @file
/// Checks that the additions of a search hold on data that it did not use.
#pragma once
#include <Eigen/Core>
#include <vector>

#include "identification/gap/closed_loop.h"
#include "identification/gap/search.h"

namespace identification::gap {

/// Criteria for an addition.
struct Judged {
  const Rows& rows;
  const Training& training;                   ///< rows that the search used
  const std::vector<Eigen::Index>& held_out;  ///< rows that it did not use
  /// Whether these are separate recordings; stretches set aside from the searched ones say no more than the
  /// blocks that the search has left out in turn.
  bool own_recordings = false;
  double noise_floor_Nm = 0;
  double resolution_rad = 0;  ///< of the encoder
  /// Held-out recordings with a set-point, of a model with a servo; not stretches of searched ones.
  std::vector<ServoRun> held_out_runs{};
};

/// Removes, the latest first, and refits the rest:
/// - an effect that hardly improves the prediction of held-out recordings;
/// - an effect whose sizes may all be zero; an elasticity or a backlash only if most of the residual is left
///   even with it, and a further harmonic of a confirmed cogging never;
/// - an effect whose size is uncertain, if most of the residual is left even with it: a cause outside the
///   library makes many effects slightly useful;
/// - an inertia that differs between driving and braking, or between small and large torques;
/// - a static torque below the Coulomb friction;
/// - a gap narrower than two steps of the encoder, or not small against the stroke, or hardly ever crossed;
/// - a second compliance between motor and load (presliding, backlash, elasticity) whose size may be zero:
///   the misfit of the first one's shape looks like that.
/// An elasticity or a backlash that is not determined at all may be the other one, as may a spring and an
/// imbalance; its addition then says so.
void confirm(SearchResult& result, const Judged& judged);

}  // namespace identification::gap
