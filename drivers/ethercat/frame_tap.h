/// @file
/// Observer of every frame sent and received.
#pragma once
#include <chrono>
#include <cstdint>
#include <span>

namespace drivers::ethercat {

enum class Direction : std::uint8_t { kSent, kReceived };

/// Cycle: called for every frame sent or received, including malformed ones.
class FrameTap {
 public:
  FrameTap() = default;
  FrameTap(const FrameTap&) = delete;
  FrameTap& operator=(const FrameTap&) = delete;
  virtual ~FrameTap() = default;
  virtual void frame(Direction direction, std::span<const std::uint8_t> bytes) noexcept = 0;
};

}  // namespace drivers::ethercat
