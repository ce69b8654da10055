/// @file
/// Source of the emulated robot's frames, and the clock of their arrival.
#pragma once
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <span>

namespace youbot_sim {

class FramePort {
 public:
  struct Frame {
    std::size_t size = 0;             ///< 0: none arrived in time, or a signal did
    std::chrono::nanoseconds came{};  ///< arrival at the machine, by now()
  };

  FramePort() = default;
  FramePort(const FramePort&) = delete;
  FramePort& operator=(const FramePort&) = delete;
  virtual ~FramePort() = default;

  /// Copies the next received frame into `buffer`.
  virtual Frame receive(std::span<std::uint8_t> buffer, std::chrono::nanoseconds timeout) noexcept = 0;
  virtual bool send(std::span<const std::uint8_t> frame) noexcept = 0;
  virtual std::chrono::nanoseconds now() const noexcept = 0;  ///< steady
};

}  // namespace youbot_sim
