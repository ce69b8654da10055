#include "hal/clock.h"

#include <cerrno>
#include <ctime>

namespace hal {
namespace {
constexpr std::chrono::nanoseconds::rep kNanosecondsPerSecond = 1'000'000'000;
}  // namespace

std::chrono::nanoseconds SteadyClock::now() const noexcept {
  timespec time{};
  clock_gettime(CLOCK_MONOTONIC, &time);
  return std::chrono::nanoseconds(time.tv_sec * kNanosecondsPerSecond + time.tv_nsec);
}

void SteadyClock::sleep_until(std::chrono::nanoseconds deadline) noexcept {
  const timespec time{deadline.count() / kNanosecondsPerSecond, deadline.count() % kNanosecondsPerSecond};
  while (clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &time, nullptr) == EINTR) {
  }
}

}  // namespace hal
