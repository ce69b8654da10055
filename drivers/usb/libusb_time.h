/// @file
/// Our durations as libusb takes them.
#pragma once
#include <sys/time.h>

#include <algorithm>
#include <chrono>

namespace drivers::usb {

/// Up to the next microsecond, so that a wait never ends before its deadline; what is negative becomes 0.
inline timeval libusb_time(std::chrono::nanoseconds duration) noexcept {
  const auto rounded = std::chrono::ceil<std::chrono::microseconds>(duration);
  const auto whole = std::max(rounded, std::chrono::microseconds(0));
  const auto seconds = std::chrono::duration_cast<std::chrono::seconds>(whole);
  return {static_cast<time_t>(seconds.count()), static_cast<suseconds_t>((whole - seconds).count())};
}

}  // namespace drivers::usb
