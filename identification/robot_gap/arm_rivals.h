/// @file
/// Other effects that explain an arm's recordings as well as a chosen one, and what would decide.
#pragma once
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "identification/robot_gap/arm_search.h"

namespace identification::robot_gap {

struct ArmRival {
  std::size_t candidate = 0;
  int wins = 0;
};
struct ArmRivals {
  std::vector<ArmRival> rivals;  ///< those that win a draw, most wins first
  int own_wins = 0;              ///< of gap::kNoiseDraws
};

/// Puts each other candidate in the place of the chosen one and draws the blocks' noise. Candidates with the
/// chosen one's terms and more are not rivals. `rows`: linearised at the chosen candidates' fit; `banned`:
/// refuted otherwise.
ArmRivals rivals_of(const control::ArmDescription& given, const ArmData& data, const Linearised& rows,
                    const Catalogue& catalogue, const Chosen& chosen, std::size_t place,
                    std::span<const std::size_t> banned, std::uint64_t seed);

/// The poses in which two fitted arms differ most, in words: states at random in the range of motion seen and
/// half of it beyond, with the speeds seen.
std::string deciding_pose(const control::ArmDescription& one, const control::ArmDescription& other,
                          const ArmData& data, std::uint64_t seed);

}  // namespace identification::robot_gap
