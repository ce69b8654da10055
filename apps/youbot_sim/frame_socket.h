/// @file
/// The slaves' end of a network cable: sends and receives EtherCAT frames on an interface.
#pragma once
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>

#include "apps/youbot_sim/frame_port.h"
#include "drivers/interface_lock.h"

namespace youbot_sim {

/// AF_PACKET, EtherType 0x88A4; needs CAP_NET_RAW and an interface that is up, which it locks against other
/// emulators. Sleeps while it waits.
class FrameSocket final : public FramePort {
 public:
  /// @throws std::runtime_error with advice: no such interface, interface down, no permission;
  /// drivers::InterfaceInUse.
  explicit FrameSocket(const std::string& interface);
  ~FrameSocket() override;
  FrameSocket(const FrameSocket&) = delete;
  FrameSocket& operator=(const FrameSocket&) = delete;

  Frame receive(std::span<std::uint8_t> buffer, std::chrono::nanoseconds timeout) noexcept override;
  bool send(std::span<const std::uint8_t> frame) noexcept override;
  std::chrono::nanoseconds now() const noexcept override;

 private:
  Frame take(std::span<std::uint8_t> buffer) noexcept;

  std::optional<drivers::InterfaceLock> lock_;
  int socket_ = -1;
};

}  // namespace youbot_sim
