/// @file
/// Whether what a search added holds where it did not look.
#pragma once
#include <Eigen/Core>
#include <vector>

#include "sim/gap/search.h"

namespace sim::gap {

/// What an addition is judged by.
struct Judged {
  const Rows& rows;
  const Training& training;                   ///< what the search has seen
  const std::vector<Eigen::Index>& held_out;  ///< rows that it has not
  double noise_floor_Nm = 0;
  double resolution_rad = 0;  ///< of the encoder
};

/// Takes away, the latest first, and refits what stays:
/// - an effect without which the held-out rows are predicted as well, or that explains little beside what is
/// left
///   over then;
/// - one whose size may as well be zero, when more is left over than it explains: a cause that is not in the
///   library makes many of the effects that are a little useful;
/// - a gap narrower than two steps of the encoder;
/// - a second one of those that give between motor and load (presliding, backlash, elasticity), when it may
///   as well be none: what the shape of the first does not fit looks like that.
/// A spring or gap that is not determined at all may be the other one, which its addition then says.
void confirm(SearchResult& result, const Judged& judged);

}  // namespace sim::gap
