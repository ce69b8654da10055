#include "identification/gap/parallel.h"

#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <cstddef>
#include <stdexcept>
#include <thread>
#include <vector>

namespace identification::gap {
namespace parallel_test {

TEST(InParallel, DoesEachPieceOnce) {
  std::vector<int> done(1000, 0);
  in_parallel(done.size(), [&](std::size_t i) { done[i] += static_cast<int>(i) + 1; });
  for (std::size_t i = 0; i < done.size(); ++i) ASSERT_EQ(done[i], static_cast<int>(i) + 1);
  in_parallel(0, [](std::size_t) { FAIL(); });
}

TEST(InParallel, PassesOnWhatAPieceThrowsWhenNoThreadRunsAnyMore) {
  std::atomic<int> running{0};
  try {
    in_parallel(20, [&](std::size_t i) {
      if (i == 0) throw std::runtime_error("piece 0");
      ++running;
      std::this_thread::sleep_for(
          std::chrono::milliseconds(2));  // long enough to be observed without waiting
      --running;
    });
    FAIL();
  } catch (const std::runtime_error& error) {
    EXPECT_STREQ(error.what(), "piece 0");
  }
  EXPECT_EQ(running, 0);
}

}  // namespace parallel_test
}  // namespace identification::gap
