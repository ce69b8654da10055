/// @file
/// Whether what a search added holds where it did not look.
#pragma once
#include <Eigen/Core>
#include <vector>

#include "identification/gap/search.h"

namespace identification::gap {

/// What an addition is judged by.
struct Judged {
  const Rows& rows;
  const Training& training;                   ///< what the search has seen
  const std::vector<Eigen::Index>& held_out;  ///< rows that it has not
  /// Whether these are of recordings of their own; stretches set aside of the searched ones say no more than
  /// the blocks that the search has left out in turn.
  bool own_recordings = false;
  double noise_floor_Nm = 0;
  double resolution_rad = 0;  ///< of the encoder
};

/// Takes away, the latest first, and refits what stays:
/// - an effect with which held-out recordings are predicted hardly better;
/// - one whose size may as well be zero, when most is left over of them with it, too: a cause that is not in
/// the library
///   makes many of the effects that are a little useful;
/// - an inertia that is another one while driving than while braking, or at small torques than at large ones;
/// - a static torque below the Coulomb friction;
/// - a gap narrower than two steps of the encoder;
/// - a second one of those that give between motor and load (presliding, backlash, elasticity), when it may
///   as well be none: what the shape of the first does not fit looks like that.
/// A spring or gap that is not determined at all may be the other one, which its addition then says.
void confirm(SearchResult& result, const Judged& judged);

}  // namespace identification::gap
