/// @file
/// Where the emulated robot's frames come from, and the clock by which they come.
#pragma once
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <span>

namespace youbot_sim {

class FramePort {
 public:
  struct Frame {
    std::size_t size = 0;             ///< 0: none came in time, or a signal did
    std::chrono::nanoseconds came{};  ///< when it reached the machine, by now()
  };

  FramePort() = default;
  FramePort(const FramePort&) = delete;
  FramePort& operator=(const FramePort&) = delete;
  virtual ~FramePort() = default;

  /// The next frame from outside, copied into `buffer`.
  virtual Frame receive(std::span<std::uint8_t> buffer, std::chrono::nanoseconds timeout) noexcept = 0;
  virtual bool send(std::span<const std::uint8_t> frame) noexcept = 0;
  virtual std::chrono::nanoseconds now() const noexcept = 0;  ///< steady
};

}  // namespace youbot_sim
