/// @file
/// Bus time of a classic frame with an 11-bit identifier.
#pragma once
#include <chrono>
#include <cstdint>

namespace drivers::can {

/// With the maximum number of stuff bits, and the three bits between frames (ISO 11898-1: 44 bits without the
/// data; worst case one stuff bit after every four of the first 34 bits and the data).
constexpr std::int64_t frame_bits(int data_bytes) noexcept {
  const std::int64_t stuffed = 34 + 8 * data_bytes;
  return 44 + 8 * data_bytes + (stuffed - 1) / 4 + 3;
}

/// Rounded up.
constexpr std::chrono::nanoseconds frame_time(int data_bytes, std::uint32_t bit_per_s) noexcept {
  return std::chrono::nanoseconds((frame_bits(data_bytes) * 1'000'000'000 + bit_per_s - 1) / bit_per_s);
}

}  // namespace drivers::can
