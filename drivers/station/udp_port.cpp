#include "drivers/station/udp_port.h"

#include <netdb.h>
#include <netinet/in.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <memory>
#include <system_error>
#include <utility>

#include "drivers/setup_error.h"
#include "drivers/uninterrupted.h"

namespace drivers::station {
namespace {

/// Expedited forwarding (RFC 3246), for routers that honour it.
constexpr int kExpedited = 0xB8;

SetupError refused(const std::string& address, bool listen, const std::string& why, const std::string& hint) {
  return SetupError({"link " + address, listen ? "listen" : "find the robot's station",
                     "HOST:PORT, such as " + std::string(listen ? "0.0.0.0:7777" : "robot.local:7777"), why,
                     hint});
}

using AddressList = std::unique_ptr<addrinfo, decltype(&::freeaddrinfo)>;

AddressList resolved(const std::string& address, bool listen) {
  const std::size_t colon = address.rfind(':');
  std::string host = address.substr(0, colon == std::string::npos ? 0 : colon);
  const std::string port = colon == std::string::npos ? "" : address.substr(colon + 1);
  if (host.size() > 2 && host.front() == '[' && host.back() == ']') host = host.substr(1, host.size() - 2);
  if (host.empty() || port.empty() || port.find_first_not_of("0123456789") != std::string::npos)
    throw refused(address, listen, "'" + address + "'", "write both");
  addrinfo wanted{};
  wanted.ai_family = AF_UNSPEC;
  wanted.ai_socktype = SOCK_DGRAM;
  wanted.ai_flags = AI_NUMERICSERV | (listen ? AI_PASSIVE : 0);
  addrinfo* found = nullptr;
  if (const int error = ::getaddrinfo(host.c_str(), port.c_str(), &wanted, &found); error != 0)
    throw refused(address, listen, ::gai_strerror(error), "check name and network");
  return {found, &::freeaddrinfo};
}

}  // namespace

UdpPort UdpPort::listening(const std::string& address) { return {address, true}; }
UdpPort UdpPort::towards(const std::string& address) { return {address, false}; }

UdpPort::UdpPort(const std::string& address, bool listen) {
  const AddressList list = resolved(address, listen);
  const addrinfo& first = *list;
  socket_ = ::socket(first.ai_family, SOCK_DGRAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0);
  const auto fail = [&](const std::string& hint) {
    const std::string why = std::generic_category().message(errno);
    if (socket_ >= 0) ::close(socket_);
    return refused(address, listen, why, hint);
  };
  if (socket_ < 0) throw fail("check the network");
  if (first.ai_family == AF_INET)
    (void)::setsockopt(socket_, IPPROTO_IP, IP_TOS, &kExpedited, sizeof kExpedited);
  else
    (void)::setsockopt(socket_, IPPROTO_IPV6, IPV6_TCLASS, &kExpedited, sizeof kExpedited);
  if (listen) {
    if (::bind(socket_, first.ai_addr, first.ai_addrlen) != 0)
      throw fail("name an address of this machine and a port that no other program uses");
    return;
  }
  std::memcpy(&other_.bytes, first.ai_addr, first.ai_addrlen);
  other_.size = first.ai_addrlen;
}

UdpPort::UdpPort(UdpPort&& other) noexcept
    : socket_(std::exchange(other.socket_, -1)), other_(other.other_), sender_(other.sender_) {}

UdpPort::~UdpPort() {
  if (socket_ >= 0) ::close(socket_);
}

std::size_t UdpPort::receive(std::span<std::uint8_t> buffer) noexcept {
  // An error of an earlier send, such as "connection refused", is reported here once; empty datagrams exist.
  constexpr int kAttempts = 4;
  for (int i = 0; i < kAttempts; ++i) {
    sender_.size = sizeof sender_.bytes;
    const ssize_t size = uninterrupted([&] {
      return ::recvfrom(socket_, buffer.data(), buffer.size(), 0, reinterpret_cast<sockaddr*>(&sender_.bytes),
                        &sender_.size);
    });
    if (size > 0) return static_cast<std::size_t>(size);
    if (size < 0 && (errno == EAGAIN || errno == EWOULDBLOCK)) return 0;
  }
  return 0;
}

void UdpPort::send(std::span<const std::uint8_t> datagram) noexcept { send_to(other_, datagram); }
void UdpPort::answer(std::span<const std::uint8_t> datagram) noexcept { send_to(sender_, datagram); }

/// A datagram that cannot be sent counts as lost: the other station's silence is what both react to.
void UdpPort::send_to(const Address& address, std::span<const std::uint8_t> datagram) const noexcept {
  if (address.size == 0) return;
  (void)uninterrupted([&] {
    return ::sendto(socket_, datagram.data(), datagram.size(), MSG_NOSIGNAL,
                    reinterpret_cast<const sockaddr*>(&address.bytes), address.size);
  });
}

}  // namespace drivers::station
