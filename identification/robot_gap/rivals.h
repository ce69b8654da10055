/// @file
/// Other effects that explain a robot's recordings as well as a chosen one.
#pragma once
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "identification/robot_gap/search.h"

namespace identification::robot_gap {

struct Rival {
  std::size_t candidate = 0;
  int wins = 0;
};
struct Rivals {
  std::vector<Rival> rivals;  ///< those that win a draw, most wins first
  int own_wins = 0;           ///< of gap::kNoiseDraws
};

/// Puts each other candidate in the place of the chosen one and draws the blocks' noise. Candidates with the
/// chosen one's terms and more are not rivals. `rows`: linearised at the chosen candidates' fit; `banned`:
/// refuted otherwise.
Rivals rivals_of(const View& view, const Linearised& rows, const Chosen& chosen, std::size_t place,
                 std::span<const std::size_t> banned, std::uint64_t seed);

}  // namespace identification::robot_gap
