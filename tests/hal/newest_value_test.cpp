// The newest value between two threads; also run under the thread sanitizer.
#include "hal/newest_value.h"

#include <gtest/gtest.h>

#include <array>
#include <atomic>
#include <cstdint>
#include <thread>

namespace newest_value_test {

TEST(NewestValue, GivesEachValueOnceAndOnlyTheLast) {
  hal::NewestValue<int> newest;
  int value = -1;
  EXPECT_FALSE(newest.take(value));
  EXPECT_EQ(value, -1);
  newest.publish(1);
  newest.publish(2);
  newest.publish(3);
  EXPECT_TRUE(newest.take(value));
  EXPECT_EQ(value, 3);
  EXPECT_FALSE(newest.take(value));
  newest.publish(4);
  EXPECT_TRUE(newest.take(value));
  EXPECT_EQ(value, 4);
}

TEST(NewestValue, NeverTearsAndNeverGoesBack) {
  // Every word of a value is the same number: a torn one shows.
  using Value = std::array<std::uint64_t, 16>;
  constexpr std::uint64_t kLast = 200'000;
  hal::NewestValue<Value> newest;
  std::thread writer([&newest] {
    for (std::uint64_t n = 1; n <= kLast; ++n) {
      Value value;
      value.fill(n);
      newest.publish(value);
    }
  });
  std::uint64_t seen = 0;
  bool whole = true;
  bool forward = true;
  while (seen < kLast) {
    Value value{};
    if (!newest.take(value)) {
      std::this_thread::yield();
      continue;
    }
    for (const std::uint64_t word : value) whole = whole && word == value[0];
    forward = forward && value[0] > seen;
    seen = value[0];
  }
  writer.join();
  EXPECT_TRUE(whole);
  EXPECT_TRUE(forward);
}

}  // namespace newest_value_test
