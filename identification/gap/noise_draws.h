/// @file
/// Which of several models would have been best with other noise.
#pragma once
#include <cstdint>
#include <vector>

namespace identification::gap {

inline constexpr int kNoiseDraws = 20;

/// For each model, how many of kNoiseDraws it wins: in a draw, blocks of the data are taken at random, with
/// repetition, and the model with the smallest residual wins. `squares`: residual of each, block by block;
/// nearly equal ones win by chance. [block bootstrap; H. R. Künsch, Ann. Statist. 17, 1989]
std::vector<int> draws_won(const std::vector<std::vector<double>>& squares, std::uint64_t seed);

}  // namespace identification::gap
