#include "identification/gap/shrink.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

namespace gap_test {
namespace {

using identification::gap::HeldOutRows;
using identification::gap::Shrink;

HeldOutRows rows_of(std::size_t recordings, Eigen::Index each) {
  HeldOutRows rows;
  const Eigen::Index count = static_cast<Eigen::Index>(recordings) * each;
  for (Eigen::Index i = 0; i < count; ++i) rows.recording.push_back(static_cast<std::size_t>(i / each));
  rows.torque_Nm = rows.before_Nm = rows.after_Nm = Eigen::VectorXd::Zero(count);
  return rows;
}

/// First-order, of standard deviation 1.
Eigen::VectorXd coloured(Eigen::Index count, double memory, std::mt19937_64& random) {
  std::normal_distribution<double> normal;
  Eigen::VectorXd values(count);
  double state = normal(random);
  for (double& value : values)
    value = state = memory * state + std::sqrt(1 - memory * memory) * normal(random);
  return values;
}

TEST(Shrink, OfHalfTheResidualEverywhereIsHalfWithoutDoubt) {
  std::mt19937_64 random(1);
  HeldOutRows rows = rows_of(3, 200);
  rows.before_Nm = coloured(600, 0.5, random);
  rows.after_Nm = 0.5 * rows.before_Nm;
  const Shrink shrink = identification::gap::shrink_of(rows, 1);
  EXPECT_NEAR(shrink.share, 0.5, 1e-12);
  EXPECT_NEAR(shrink.lower, 0.5, 1e-12);
  EXPECT_NEAR(shrink.upper, 0.5, 1e-12);
}

TEST(Shrink, OfAGapThatGrewIsBelowZero) {
  HeldOutRows rows = rows_of(1, 100);
  rows.before_Nm.setConstant(0.1);
  rows.after_Nm.setConstant(0.15);
  EXPECT_NEAR(identification::gap::shrink_of(rows, 1).share, -0.5, 1e-12);
}

// Before: an effect and noise. After: noise. Each of the noise coloured, so that rows are not independent.
TEST(Shrink, HasAnIntervalThatHoldsTheTruthAsOftenAsItSays) {
  std::mt19937_64 random(7);
  const double truth = 1 - 0.5 / std::hypot(0.5, 1.0);
  int held = 0;
  constexpr int kDraws = 300;
  for (int n = 0; n < kDraws; ++n) {
    HeldOutRows rows = rows_of(5, 400);
    rows.after_Nm = 0.5 * coloured(2000, 0.7, random);
    rows.before_Nm = rows.after_Nm + coloured(2000, 0.7, random);
    const Shrink shrink = identification::gap::shrink_of(rows, static_cast<std::uint64_t>(n));
    held += shrink.lower <= truth && truth <= shrink.upper ? 1 : 0;
  }
  EXPECT_GE(held, 0.91 * kDraws);
  EXPECT_LT(held, kDraws) << "an interval that always holds the truth says too little";
}

TEST(RecordingGaps, AreSharesOfTheTorqueOfEachRecordingAndOfAll) {
  HeldOutRows rows = rows_of(2, 2);
  rows.torque_Nm << 3, -3, 5, -1;  // standard deviations 3 and 3
  rows.before_Nm << 0.3, -0.3, 0.6, 0.6;
  rows.after_Nm << 0.0, 0.0, 0.3, -0.3;
  const auto gaps = identification::gap::recording_gaps(rows, {"a.csv", "b.csv"});
  ASSERT_EQ(gaps.size(), 3U);
  EXPECT_EQ(gaps[0].recording, "a.csv");
  EXPECT_NEAR(gaps[0].before_Nm, 0.3, 1e-12);
  EXPECT_NEAR(gaps[0].nrmse_before, 0.1, 1e-12);
  EXPECT_NEAR(gaps[0].vaf_before, 0.99, 1e-12);
  EXPECT_NEAR(gaps[0].vaf_after, 1, 1e-12);
  EXPECT_NEAR(gaps[1].nrmse_before, 0.2, 1e-12);
  EXPECT_NEAR(gaps[1].vaf_before, 1, 1e-12) << "a constant residual has no variance";
  EXPECT_NEAR(gaps[1].nrmse_after, 0.1, 1e-12);
  EXPECT_EQ(gaps[2].recording, "");
  EXPECT_NEAR(gaps[2].before_Nm, std::sqrt((2 * 0.09 + 2 * 0.36) / 4), 1e-12);
}

}  // namespace
}  // namespace gap_test
