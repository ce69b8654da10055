/// @file
/// The slaves' end of a network cable: EtherCAT frames in and out of an interface.
#pragma once
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>

#include "drivers/interface_lock.h"

namespace youbot_sim {

/// AF_PACKET, EtherType 0x88A4; needs CAP_NET_RAW and an interface that is up, which it has for itself as far
/// as slaves go. Sleeps while it waits.
class FrameSocket {
 public:
  /// @throws std::runtime_error saying what to do: no such interface, interface down, no permission;
  ///         drivers::InterfaceInUse.
  explicit FrameSocket(const std::string& interface);
  ~FrameSocket();
  FrameSocket(const FrameSocket&) = delete;
  FrameSocket& operator=(const FrameSocket&) = delete;

  /// The size of the next frame from outside, 0 when none came in time or a signal did.
  std::size_t receive(std::span<std::uint8_t> buffer, std::chrono::nanoseconds timeout) noexcept;
  bool send(std::span<const std::uint8_t> frame) noexcept;

 private:
  std::optional<drivers::InterfaceLock> lock_;
  int socket_ = -1;
};

}  // namespace youbot_sim
