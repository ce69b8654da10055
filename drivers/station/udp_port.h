/// @file
/// DatagramPort over a UDP socket, IPv4 or IPv6.
#pragma once
#include <sys/socket.h>

#include <string>
#include <vector>

#include "drivers/station/datagram_port.h"

namespace drivers::station {

/// Of a name; further ones are not tried.
inline constexpr std::size_t kMaxAddresses = 8;

/// Datagrams of every sender arrive: the session above authenticates them.
class UdpPort final : public DatagramPort {
 public:
  /// Setup: receives at "HOST:PORT" or "[IPV6]:PORT", such as "0.0.0.0:7777". The other station is the one
  /// that is adopted. @throws SetupError naming the address.
  static UdpPort listening(const std::string& address);
  /// Setup: at a free port, with the other station at this address; a name is resolved now, once. It may have
  /// several addresses, of which the other station listens at one: that is the one that is adopted.
  /// @throws SetupError naming the address.
  static UdpPort towards(const std::string& address);
  UdpPort(UdpPort&& other) noexcept;
  UdpPort& operator=(UdpPort&&) = delete;
  ~UdpPort() override;

  std::size_t receive(std::span<std::uint8_t> buffer) noexcept override;
  void send(std::span<const std::uint8_t> datagram) noexcept override;
  void send_to_all(std::span<const std::uint8_t> datagram) noexcept override;
  void answer(std::span<const std::uint8_t> datagram) noexcept override;
  void adopt_sender() noexcept override { other_ = sender_; }

 private:
  struct Address {
    sockaddr_storage bytes{};
    socklen_t size = 0;  ///< 0: unknown
  };
  explicit UdpPort(int socket);
  void send_to(const Address& address, std::span<const std::uint8_t> datagram) const noexcept;

  int socket_ = -1;
  std::vector<Address> possible_;  // of the other station
  Address other_;
  Address sender_;
};

}  // namespace drivers::station
