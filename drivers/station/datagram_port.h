/// @file
/// The seam below a station: sends and receives datagrams, which may be lost, late, repeated or a stranger's.
#pragma once
#include <cstddef>
#include <cstdint>
#include <span>

namespace drivers::station {

/// One thread. Cycle: nothing blocks, allocates or throws.
class DatagramPort {
 public:
  DatagramPort() = default;
  DatagramPort(const DatagramPort&) = delete;
  DatagramPort& operator=(const DatagramPort&) = delete;
  virtual ~DatagramPort() = default;

  /// Bytes of the next datagram; 0: none waits. One that is longer than `buffer` arrives truncated.
  virtual std::size_t receive(std::span<std::uint8_t> buffer) noexcept = 0;
  /// To the other station; lost if none is known yet.
  virtual void send(std::span<const std::uint8_t> datagram) noexcept = 0;
  /// To every address at which the other station may be.
  virtual void send_to_all(std::span<const std::uint8_t> datagram) noexcept { send(datagram); }
  /// To the sender of the datagram that was received last.
  virtual void answer(std::span<const std::uint8_t> datagram) noexcept = 0;
  /// The sender of the datagram that was received last is the other station.
  virtual void adopt_sender() noexcept = 0;
};

}  // namespace drivers::station
