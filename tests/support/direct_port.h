/// @file
/// Two DatagramPorts joined directly, without allocation.
#pragma once
#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

#include "drivers/station/datagram_port.h"
#include "drivers/station/message.h"

namespace support {

/// Holds the last few datagrams for its owner. `other` is set before use.
class DirectPort final : public drivers::station::DatagramPort {
 public:
  std::size_t receive(std::span<std::uint8_t> buffer) noexcept override {
    if (taken_ == put_) return 0;
    const Slot& slot = slots_[taken_++ % slots_.size()];
    std::copy_n(slot.bytes.begin(), slot.size, buffer.begin());
    return slot.size;
  }
  void send(std::span<const std::uint8_t> datagram) noexcept override {
    Slot& slot = other->slots_[other->put_++ % slots_.size()];
    std::copy(datagram.begin(), datagram.end(), slot.bytes.begin());
    slot.size = datagram.size();
  }
  void answer(std::span<const std::uint8_t> datagram) noexcept override { send(datagram); }
  void adopt_sender() noexcept override {}
  DirectPort* other = nullptr;

 private:
  struct Slot {
    std::array<std::uint8_t, drivers::station::kMaxMessageBytes> bytes{};
    std::size_t size = 0;
  };
  std::array<Slot, 8> slots_{};
  std::size_t put_ = 0;
  std::size_t taken_ = 0;
};

}  // namespace support
