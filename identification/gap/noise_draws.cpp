#include "identification/gap/noise_draws.h"

#include <algorithm>
#include <cstddef>
#include <random>

namespace identification::gap {
namespace {

/// Share of the square below which two models count as equal, however significant the difference: with one
/// more parameter, left-out blocks are predicted slightly worse even if it is the same model.
constexpr double kTie = 0.01;

}  // namespace

std::vector<int> draws_won(const std::vector<std::vector<double>>& squares, std::uint64_t seed) {
  std::vector<int> wins(squares.size(), 0);
  if (squares.empty() || squares.front().empty()) return wins;
  std::mt19937_64 random(seed);
  const std::size_t blocks = squares.front().size();
  for (int draw = 0; draw < kNoiseDraws; ++draw) {
    std::vector<double> left(squares.size(), 0);
    for (std::size_t taken = 0; taken < blocks; ++taken) {
      const std::size_t block = random() % blocks;
      for (std::size_t model = 0; model < squares.size(); ++model) left[model] += squares[model][block];
    }
    const double least = *std::ranges::min_element(left);
    std::vector<std::size_t> best;
    for (std::size_t model = 0; model < squares.size(); ++model)
      if (left[model] <= (1 + kTie) * least) best.push_back(model);
    ++wins[best[random() % best.size()]];
  }
  return wins;
}

}  // namespace identification::gap
