/// @file
/// Who wants to see every frame.
#pragma once
#include <chrono>
#include <cstdint>
#include <span>

namespace drivers::ethercat {

enum class Direction : std::uint8_t { kSent, kReceived };

/// Cycle: called for every frame as it is sent or received, malformed ones too.
class FrameTap {
 public:
  FrameTap() = default;
  FrameTap(const FrameTap&) = delete;
  FrameTap& operator=(const FrameTap&) = delete;
  virtual ~FrameTap() = default;
  virtual void frame(Direction direction, std::span<const std::uint8_t> bytes) noexcept = 0;
};

}  // namespace drivers::ethercat
