#include "drivers/latency_histogram.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

namespace drivers {
namespace latency_histogram_test {

using namespace std::chrono_literals;

TEST(LatencyHistogram, QuantilesAreAtMostASixteenthTooHighAndNeverTooLow) {
  std::mt19937_64 random(7);
  std::lognormal_distribution<double> law(std::log(20e3), 1.0);
  LatencyHistogram histogram;
  std::vector<std::int64_t> values;
  for (int i = 0; i < 100'000; ++i) {
    values.push_back(static_cast<std::int64_t>(law(random)));
    histogram.add(std::chrono::nanoseconds(values.back()));
  }
  std::sort(values.begin(), values.end());
  for (const double fraction : {0.001, 0.1, 0.5, 0.9, 0.99, 0.999}) {
    const auto exact = static_cast<double>(values[static_cast<std::size_t>(std::ceil(fraction * 1e5)) - 1]);
    const auto found = static_cast<double>(histogram.quantile(fraction).count());
    EXPECT_GE(found, exact) << fraction;
    EXPECT_LE(found, exact * (1 + 1.0 / 16)) << fraction;
  }
  EXPECT_EQ(histogram.quantile(1.0).count(), values.back());
}

TEST(LatencyHistogram, EveryValueFallsIntoABucketThatEndsAtOrAboveIt) {
  for (std::int64_t value = 1; value < (std::int64_t{1} << 32); value += 1 + value / 97) {
    LatencyHistogram histogram;
    histogram.add(std::chrono::nanoseconds(value));
    histogram.add(10s);  // so that the quantile is the bucket's end and not the worst value
    const auto end = histogram.quantile(0.5).count();
    ASSERT_GE(end, value);
    ASSERT_LE(static_cast<double>(end), static_cast<double>(value) * (1 + 1.0 / 16));
  }
}

TEST(LatencyHistogram, NegativeCountsAsZeroAndTheWorstIsExact) {
  LatencyHistogram histogram;
  histogram.add(-5ns);
  EXPECT_EQ(histogram.quantile(0.5), 0ns);
  histogram.add(100s);
  EXPECT_EQ(histogram.worst(), 100s);
  EXPECT_EQ(LatencyHistogram{}.quantile(0.5), 0ns);
}

}  // namespace latency_histogram_test
}  // namespace drivers
