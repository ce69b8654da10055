// How often each of several names wins when the noise is redrawn.
#include <gtest/gtest.h>

#include <cmath>
#include <numeric>
#include <random>
#include <vector>

#include "identification/gap/noise_draws.h"

namespace gap_test {
namespace {

using identification::gap::draws_won;
using identification::gap::kNoiseDraws;

std::vector<double> squares(double mean, double spread, unsigned seed) {
  std::mt19937 random(seed);
  std::normal_distribution<double> each(mean, spread);
  std::vector<double> result(32);
  for (double& square : result) square = each(random);
  return result;
}

TEST(NoiseDraws, AModelThatIsBetterEverywhereWinsAll) {
  const std::vector<int> wins = draws_won({squares(2, 0.1, 1), squares(1, 0.1, 2), squares(3, 0.1, 3)}, 1);
  EXPECT_EQ(wins, (std::vector<int>{0, kNoiseDraws, 0}));
}

TEST(NoiseDraws, ModelsThatAreTheSameWinByChance) {
  const std::vector<double> same = squares(1, 0.2, 1);
  const std::vector<int> wins = draws_won({same, same}, 1);
  EXPECT_EQ(wins[0] + wins[1], kNoiseDraws);
  // Two in twenty or fewer has a probability of 0.0002.
  EXPECT_GT(std::min(wins[0], wins[1]), 2);
}

// The mean of 32 differences with a standard deviation of one has one of 0.18: a lead of 0.09 is half of that
// and loses Φ(−0.5) = 31 % of all draws; one of 0.9 is five of it and loses none.
TEST(NoiseDraws, ALeadCountsAgainstItsScatter) {
  const auto lost_of = [](double lead) {
    int lost = 0;
    for (unsigned seed = 0; seed < 50; ++seed) {
      std::vector<double> worse = squares(0, 1, seed);
      const double mean = std::accumulate(worse.begin(), worse.end(), 0.0) / 32;
      for (double& square : worse) square += 3 + lead - mean;
      lost += draws_won({std::vector<double>(32, 3.0), worse}, seed)[1];
    }
    return lost / (50.0 * kNoiseDraws);
  };
  EXPECT_NEAR(lost_of(0.5 / std::sqrt(32.0)), 0.31, 0.05);
  EXPECT_LT(lost_of(5 / std::sqrt(32.0)), 0.002);
}

TEST(NoiseDraws, TheSameSeedDealsTheSame) {
  const std::vector<std::vector<double>> both{squares(1, 0.3, 1), squares(1.02, 0.3, 2)};
  EXPECT_EQ(draws_won(both, 7), draws_won(both, 7));
}

}  // namespace
}  // namespace gap_test
