/// @file
/// Durations converted for libusb.
#pragma once
#include <sys/time.h>

#include <algorithm>
#include <chrono>

namespace drivers::usb {

/// Rounded up to microseconds, so that a wait never ends before its deadline; negative values become 0.
inline timeval libusb_time(std::chrono::nanoseconds duration) noexcept {
  const auto rounded = std::chrono::ceil<std::chrono::microseconds>(duration);
  const auto whole = std::max(rounded, std::chrono::microseconds(0));
  const auto seconds = std::chrono::duration_cast<std::chrono::seconds>(whole);
  return {static_cast<time_t>(seconds.count()), static_cast<suseconds_t>((whole - seconds).count())};
}

}  // namespace drivers::usb
