// Time as a parameter. No test here checks a duration.
#include "hal/clock.h"

#include <gtest/gtest.h>

#include <chrono>

#include "tests/support/no_alloc_guard.h"

namespace clock_test {

using namespace std::chrono_literals;
using std::chrono::nanoseconds;

TEST(VirtualClock, StartsAtZeroAndStandsStill) {
  const hal::VirtualClock clock;
  EXPECT_EQ(clock.now(), 0ns);
  EXPECT_EQ(clock.now(), 0ns);
}

TEST(VirtualClock, SleepingJumpsToTheDeadlineExactly) {
  hal::VirtualClock clock;
  for (int cycle = 1; cycle <= 1000; ++cycle) {
    clock.sleep_until(cycle * 1ms);
    ASSERT_EQ(clock.now(), cycle * 1ms);
  }
}

TEST(VirtualClock, NeverGoesBack) {
  hal::VirtualClock clock;
  clock.sleep_until(5ms);
  clock.sleep_until(3ms);
  EXPECT_EQ(clock.now(), 5ms);
  clock.sleep_until(-1ms);
  EXPECT_EQ(clock.now(), 5ms);
}

TEST(SteadyClock, IsMonotonic) {
  const hal::SteadyClock clock;
  nanoseconds last = clock.now();
  for (int i = 0; i < 1000; ++i) {
    const nanoseconds now = clock.now();
    ASSERT_GE(now, last);
    last = now;
  }
}

TEST(SteadyClock, CountsTheSameTimeAsTheStandardLibrary) {
  // libstdc++'s steady_clock is CLOCK_MONOTONIC: each reading must lie between the two around it.
  const hal::SteadyClock clock;
  const nanoseconds before = std::chrono::steady_clock::now().time_since_epoch();
  const nanoseconds now = clock.now();
  const nanoseconds after = std::chrono::steady_clock::now().time_since_epoch();
  EXPECT_LE(before, now);
  EXPECT_LE(now, after);
}

TEST(SteadyClock, NeverWakesBeforeTheDeadline) {
  hal::SteadyClock clock;
  for (int i = 0; i < 3; ++i) {
    const nanoseconds deadline = clock.now() + 1'234'567ns;
    clock.sleep_until(deadline);
    EXPECT_GE(clock.now(), deadline);
  }
}

TEST(SteadyClock, ReturnsFromDeadlinesThatHavePassed) {
  hal::SteadyClock clock;
  const nanoseconds before = clock.now();
  clock.sleep_until(before);
  clock.sleep_until(before - 1h);
  clock.sleep_until(0ns);
  clock.sleep_until(-1ns);  // not a valid timespec
  EXPECT_LT(clock.now() - before, 1min) << "generous: this machine may be busy";
}

TEST(SteadyClock, DoesNotAllocateOrLock) {
  if (!support::NoAllocGuard::kActive) GTEST_SKIP() << "the sanitizer owns malloc";
  hal::SteadyClock clock;
  const support::NoAllocGuard guard;
  clock.sleep_until(clock.now() + 1us);
  EXPECT_EQ(guard.violations(), 0);
}

}  // namespace clock_test
