#include "runtime/sample_clock.h"

#include <gtest/gtest.h>

#include <random>

namespace runtime {
namespace sample_clock_test {

using namespace std::chrono_literals;
using std::chrono::nanoseconds;

TEST(SampleClock, ASampleOfEachPeriodTakesOne) {
  SampleClock clock(1ms);
  for (nanoseconds stamp = 1ms; stamp < 100ms; stamp += 1ms) EXPECT_EQ(clock.elapsed_s(stamp), 1e-3);
}

TEST(SampleClock, ASampleThatIsNoNewOneTakesNoTimeAndTheNextBringsIt) {
  SampleClock clock(1ms);
  clock.elapsed_s(10ms);
  for (int n = 0; n < 10; ++n) EXPECT_EQ(clock.elapsed_s(10ms), 0);
  EXPECT_DOUBLE_EQ(clock.elapsed_s(21ms), 11e-3);
  EXPECT_EQ(clock.elapsed_s(22ms), 1e-3);
}

TEST(SampleClock, FromOneAndAHalfPeriodsOnAGapTakesItsOwnTime) {
  for (const auto& [gap, elapsed_s] : {std::pair<nanoseconds, double>{600us, 1e-3},
                                       {1400us, 1e-3},
                                       {1600us, 1.6e-3},
                                       {2ms, 2e-3},
                                       {95ms, 95e-3}}) {
    SampleClock clock(1ms);
    clock.elapsed_s(10ms);
    EXPECT_DOUBLE_EQ(clock.elapsed_s(10ms + gap), elapsed_s) << gap.count();
  }
}

TEST(SampleClock, NoTimeIsCountedTwiceNorLeftOutHoweverLateOrEarlySamplesCome) {
  std::mt19937 random(1);
  for (const double spread : {0.2, 0.7, 0.99, 3.0}) {
    SampleClock clock(1ms);
    std::uniform_real_distribution<double> gap_ms(std::max(0.01, 1 - spread), 1 + spread);
    nanoseconds stamp = 5s;
    double counted_s = clock.elapsed_s(stamp) - 5;
    for (int n = 0; n < 100'000; ++n) {
      if (n % 3 == 0) {
        EXPECT_EQ(clock.elapsed_s(stamp), 0);
      }
      stamp += nanoseconds(static_cast<std::int64_t>(1e6 * gap_ms(random)));
      const double elapsed_s = clock.elapsed_s(stamp);
      ASSERT_GE(elapsed_s, 0);
      counted_s += elapsed_s;
      ASSERT_NEAR(counted_s, std::chrono::duration<double>(stamp - 5s).count(), 0.5e-3 + 1e-9) << n;
    }
  }
}

}  // namespace sample_clock_test
}  // namespace runtime
