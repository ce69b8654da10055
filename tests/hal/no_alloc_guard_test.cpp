// The guard behind every "DoesNotAllocateOrLock" test must itself detect what it claims to detect.
#include "tests/support/no_alloc_guard.h"

#include <gtest/gtest.h>

#include <atomic>
#include <cstdlib>
#include <memory>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

namespace no_alloc_guard_test {

using support::NoAllocGuard;

/// Keeps the compiler from removing an allocation whose result it sees through.
template <class T>
void keep(T* pointer) {
  asm volatile("" : : "g"(pointer) : "memory");
}

class NoAllocGuardTest : public testing::Test {
 protected:
  void SetUp() override {
    if (!NoAllocGuard::kActive) GTEST_SKIP() << "the sanitizer owns malloc, the guard counts nothing";
  }
};

TEST_F(NoAllocGuardTest, CountsNothingWhenNothingHappens) {
  const NoAllocGuard guard;
  volatile double sum = 0;
  for (int i = 0; i < 100; ++i) sum = sum + i;
  EXPECT_EQ(guard.violations(), 0);
}

TEST_F(NoAllocGuardTest, CountsNewAndDelete) {
  const NoAllocGuard guard;
  int* const number = new int(1);
  keep(number);
  EXPECT_EQ(guard.violations(), 1);
  delete number;
  EXPECT_EQ(guard.violations(), 2);
}

TEST_F(NoAllocGuardTest, CountsNewOfOverAlignedTypes) {
  struct alignas(64) Line {
    double values[8];
  };
  const NoAllocGuard guard;
  Line* const line = new Line{};
  keep(line);
  EXPECT_GE(guard.violations(), 1);
  delete line;
}

TEST_F(NoAllocGuardTest, CountsTheCFamily) {
  const NoAllocGuard guard;
  void* block = std::malloc(8);
  keep(block);
  block = std::realloc(block, 16);
  keep(block);
  EXPECT_EQ(guard.violations(), 2);
  std::free(block);
  block = std::calloc(2, 8);
  keep(block);
  EXPECT_EQ(guard.violations(), 4);
  std::free(block);
  block = std::aligned_alloc(64, 64);
  keep(block);
  std::free(block);
  EXPECT_EQ(posix_memalign(&block, 64, 64), 0);
  keep(block);
  std::free(block);
  EXPECT_EQ(guard.violations(), 9);
}

TEST_F(NoAllocGuardTest, CountsContainersAndStrings) {
  const NoAllocGuard guard;
  const std::vector<double> vector(100);
  keep(vector.data());
  EXPECT_EQ(guard.violations(), 1);
  const std::string string(100, 'x');
  keep(string.data());
  EXPECT_EQ(guard.violations(), 2);
}

TEST_F(NoAllocGuardTest, CountsAMutex) {
  std::mutex mutex;
  mutex.lock();  // the interposer looks libc's function up on the first lock of the process
  mutex.unlock();
  const NoAllocGuard guard;
  const std::lock_guard lock(mutex);
  EXPECT_EQ(guard.violations(), 1);
}

TEST_F(NoAllocGuardTest, CountsOnlyWhileItLives) {
  keep(std::make_unique<int>(1).get());
  {
    const NoAllocGuard guard;
    EXPECT_EQ(guard.violations(), 0);
  }
  keep(std::make_unique<int>(2).get());
  const NoAllocGuard guard;
  EXPECT_EQ(guard.violations(), 0);
}

TEST_F(NoAllocGuardTest, DoesNotCountOtherThreads) {
  std::atomic<bool> go = false;
  std::atomic<bool> done = false;
  std::thread other([&] {
    while (!go) std::this_thread::yield();
    for (int i = 0; i < 10; ++i) keep(std::make_unique<int>(i).get());
    done = true;
  });
  long seen = -1;
  {
    const NoAllocGuard guard;
    go = true;
    while (!done) std::this_thread::yield();
    seen = guard.violations();
  }
  other.join();
  EXPECT_EQ(seen, 0);
}

}  // namespace no_alloc_guard_test
