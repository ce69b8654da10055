/// @file
/// Durations as plain numbers, for formulas, files and messages; use std::chrono everywhere else.
#pragma once
#include <chrono>

namespace hal {

constexpr double seconds(std::chrono::nanoseconds time) noexcept {
  return std::chrono::duration<double>(time).count();
}
constexpr double milliseconds(std::chrono::nanoseconds time) noexcept {
  return std::chrono::duration<double, std::milli>(time).count();
}
constexpr double microseconds(std::chrono::nanoseconds time) noexcept {
  return std::chrono::duration<double, std::micro>(time).count();
}

}  // namespace hal
