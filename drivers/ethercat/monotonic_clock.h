/// @file
#pragma once
#include <chrono>
#include <ctime>

namespace drivers::ethercat {

/// CLOCK_MONOTONIC, the clock of a real wire (Link::now()).
inline std::chrono::nanoseconds monotonic_now() noexcept {
  timespec time{};
  clock_gettime(CLOCK_MONOTONIC, &time);
  return std::chrono::seconds(time.tv_sec) + std::chrono::nanoseconds(time.tv_nsec);
}

}  // namespace drivers::ethercat
