#include <sched.h>
#include <time.h>

#include <cerrno>
#include <fstream>
#include <sstream>

#include "tests/bench/ethercat_master.h"

namespace bench {
namespace {

std::chrono::nanoseconds read_clock(clockid_t clock) {
  timespec time{};
  clock_gettime(clock, &time);
  return std::chrono::seconds(time.tv_sec) + std::chrono::nanoseconds(time.tv_nsec);
}

}  // namespace

std::chrono::nanoseconds now() { return read_clock(CLOCK_MONOTONIC); }
std::chrono::nanoseconds thread_cpu() { return read_clock(CLOCK_THREAD_CPUTIME_ID); }

void sleep_until(std::chrono::nanoseconds time) {
  const timespec until{time.count() / 1'000'000'000, time.count() % 1'000'000'000};
  while (clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &until, nullptr) == EINTR) {
  }
}

bool become_real_time() {
  sched_param priority{};
  priority.sched_priority = 20;
  return sched_setscheduler(0, SCHED_FIFO, &priority) == 0;
}

std::uint64_t frames_sent(const std::string& interface) {
  // "  veth-c: bytes packets errs drop fifo frame compressed multicast bytes packets ...", of this thread's
  // namespace.
  std::ifstream table("/proc/thread-self/net/dev");
  for (std::string line; std::getline(table, line);) {
    const std::size_t colon = line.find(':');
    if (colon == std::string::npos || line.substr(0, colon).find(interface) == std::string::npos) continue;
    std::istringstream columns(line.substr(colon + 1));
    std::uint64_t value = 0;
    for (int column = 0; column < 10; ++column) columns >> value;
    return value;
  }
  return 0;
}

}  // namespace bench
