/// @file
/// Processor time of the calling thread. Tests measure it instead of wall-clock time, which depends on the
/// load of the machine.
#pragma once
#include <chrono>
#include <ctime>

namespace support {

inline std::chrono::nanoseconds processor_time() {
  timespec time{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &time);
  return std::chrono::seconds(time.tv_sec) + std::chrono::nanoseconds(time.tv_nsec);
}

}  // namespace support
