/// @file
/// Which of several models would have been best, had the noise been dealt otherwise.
#pragma once
#include <cstdint>
#include <vector>

namespace identification::gap {

inline constexpr int kNoiseDraws = 20;

/// Of each model, how many of kNoiseDraws it wins: in a draw, blocks of the data are taken at random, with
/// repetition, and the model that leaves least of them wins. `squares`: what each leaves, block by block;
/// those that leave nearly the same win by chance. [block bootstrap; H. R. Künsch, Ann. Statist. 17, 1989]
std::vector<int> draws_won(const std::vector<std::vector<double>>& squares, std::uint64_t seed);

}  // namespace identification::gap
