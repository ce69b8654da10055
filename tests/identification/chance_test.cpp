// How often a search gains as much by chance.
#include "identification/chance.h"

#include <gtest/gtest.h>

#include <random>

namespace identification {
namespace chance_test {

ChanceTest test_of_a_mean(std::mt19937_64& random, int& draws) {
  return {.draw =
              [&] {
                std::normal_distribution<double> noise;
                ++draws;
                return Eigen::VectorXd(Eigen::VectorXd::NullaryExpr(10, [&] { return noise(random); }));
              },
          .most_gain = [](const Eigen::VectorXd& data) { return data.mean(); }};
}

TEST(ChanceTest, DataOfChanceGetASmallPValueAsOftenAsItSays) {
  std::mt19937_64 random(1);
  int draws = 0;
  const ChanceTest test = test_of_a_mean(random, draws);
  constexpr int kTrials = 500;
  int small = 0;
  for (int i = 0; i < kTrials; ++i) small += test.p_value(test.most_gain(test.draw())) <= 0.05 ? 1 : 0;
  // 5 % of 500 are 25, with a standard deviation of 5.
  EXPECT_GE(small, 10);
  EXPECT_LE(small, 40);
}

TEST(ChanceTest, AGainThatChanceNeverReachesTakesAllRepetitions) {
  std::mt19937_64 random(1);
  int draws = 0;
  EXPECT_EQ(test_of_a_mean(random, draws).p_value(100), 0.01);
  EXPECT_EQ(draws, 99);
}

TEST(ChanceTest, StopsOnceTheAnswerIsNo) {
  std::mt19937_64 random(1);
  int draws = 0;
  EXPECT_EQ(test_of_a_mean(random, draws).p_value(-100), 1);
  EXPECT_EQ(draws, 16);
}

}  // namespace chance_test
}  // namespace identification
