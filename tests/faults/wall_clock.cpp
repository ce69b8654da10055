#include "tests/faults/wall_clock.h"

#include <sys/syscall.h>
#include <unistd.h>

#include <atomic>
#include <ctime>

namespace {

std::atomic<std::time_t> jump_s{0};

}  // namespace

void faults::jump_wall_clock(std::chrono::duration<double> by) noexcept {
  jump_s = static_cast<std::time_t>(by.count());
}

// In place of the C library's, for all of this process.
extern "C" int clock_gettime(clockid_t clock, struct timespec* now) noexcept {
  const long result = syscall(SYS_clock_gettime, clock, now);
  if (result == 0 && clock == CLOCK_REALTIME) now->tv_sec += jump_s.load(std::memory_order_relaxed);
  return static_cast<int>(result);
}

extern "C" std::time_t time(std::time_t* result) noexcept {
  struct timespec now {};
  if (clock_gettime(CLOCK_REALTIME, &now) != 0) return -1;
  if (result != nullptr) *result = now.tv_sec;
  return now.tv_sec;
}
