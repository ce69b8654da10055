// Triangular velocity profiles with decreasing amplitude.
#include <gtest/gtest.h>

#include <stdexcept>
#include <vector>

#include "identification/experiments/reversals.h"

namespace identification::experiments {
namespace experiments_reversals_test {

constexpr ReversalsConfig kConfig{
    .highest_rad_per_s = 9, .lowest_rad_per_s = 1, .shrink = 3, .period_s = 4, .periods = 2};

double wanted_at(Reversals& reversals, double time_s) {
  const SetPoint set_point = reversals.step({.time_s = time_s});
  EXPECT_EQ(set_point.command.mode, hal::CommandMode::kVelocity);
  return set_point.command.target;
}

TEST(Reversals, EachHeightHasItsPeriodsAndTheLowestIsTheLast) {
  Reversals reversals(kConfig);
  EXPECT_EQ(reversals.heights_rad_per_s(), (std::vector<double>{9, 3, 1}));
  EXPECT_DOUBLE_EQ(reversals.duration_s(0), 24);
}

TEST(Reversals, APeriodGoesUpThroughZeroDownAndBack) {
  Reversals reversals(kConfig);
  reversals.begin(0, {});
  EXPECT_NEAR(wanted_at(reversals, 0), 0, 1e-12);
  EXPECT_NEAR(wanted_at(reversals, 0.5), 4.5, 1e-12);
  EXPECT_NEAR(wanted_at(reversals, 1), 9, 1e-12);
  EXPECT_NEAR(wanted_at(reversals, 2), 0, 1e-12);
  EXPECT_NEAR(wanted_at(reversals, 3), -9, 1e-12);
  EXPECT_NEAR(wanted_at(reversals, 4), 0, 1e-12);
  EXPECT_NEAR(wanted_at(reversals, 8 + 1), 3, 1e-12);
  EXPECT_NEAR(wanted_at(reversals, 16 + 3), -1, 1e-12);
  EXPECT_FALSE(reversals.finished());
  EXPECT_EQ(wanted_at(reversals, 24), 0);
  EXPECT_TRUE(reversals.finished());
  reversals.begin(1, {});
  EXPECT_FALSE(reversals.finished());
}

TEST(Reversals, ValuesOutOfRangeAreRefused) {
  ReversalsConfig upside_down = kConfig;
  upside_down.lowest_rad_per_s = 10;
  EXPECT_THROW(Reversals{upside_down}, std::invalid_argument);
  ReversalsConfig growing = kConfig;
  growing.shrink = 0.5;
  EXPECT_THROW(Reversals{growing}, std::invalid_argument);
}

}  // namespace experiments_reversals_test
}  // namespace identification::experiments
