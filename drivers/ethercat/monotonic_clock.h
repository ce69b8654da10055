/// @file
#pragma once
#include <chrono>
#include <ctime>

namespace drivers::ethercat {

/// CLOCK_MONOTONIC. Deadlines on the wire are real time even when the loop above runs in virtual time.
inline std::chrono::nanoseconds monotonic_now() noexcept {
  timespec time{};
  clock_gettime(CLOCK_MONOTONIC, &time);
  return std::chrono::seconds(time.tv_sec) + std::chrono::nanoseconds(time.tv_nsec);
}

}  // namespace drivers::ethercat
