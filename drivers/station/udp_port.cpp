#include "drivers/station/udp_port.h"

#include <netdb.h>
#include <netinet/in.h>
#include <unistd.h>

#include <algorithm>
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

struct Place {
  std::string host;
  std::string port;
};

Place parsed(const std::string& address, bool listen) {
  const std::size_t colon = address.rfind(':');
  Place place{.host = address.substr(0, colon == std::string::npos ? 0 : colon),
              .port = colon == std::string::npos ? "" : address.substr(colon + 1)};
  std::string& host = place.host;
  if (host.size() > 2 && host.front() == '[' && host.back() == ']') host = host.substr(1, host.size() - 2);
  if (host.empty() || place.port.empty() || place.port.find_first_not_of("0123456789") != std::string::npos)
    throw refused(address, listen, "'" + address + "'", "write both");
  return place;
}

AddressList resolved(const std::string& address, bool listen, int family, int flags) {
  const Place place = parsed(address, listen);
  addrinfo wanted{};
  wanted.ai_family = family;
  wanted.ai_socktype = SOCK_DGRAM;
  wanted.ai_flags = AI_NUMERICSERV | flags;
  addrinfo* found = nullptr;
  if (const int error = ::getaddrinfo(place.host.c_str(), place.port.c_str(), &wanted, &found); error != 0)
    throw refused(address, listen, ::gai_strerror(error), "check name and network");
  return {found, &::freeaddrinfo};
}

int open_socket(int family) noexcept {
  const int socket = ::socket(family, SOCK_DGRAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0);
  if (socket < 0) return socket;
  // An IPv6 socket that also carries IPv4 has both.
  (void)::setsockopt(socket, IPPROTO_IP, IP_TOS, &kExpedited, sizeof kExpedited);
  if (family == AF_INET6) {
    (void)::setsockopt(socket, IPPROTO_IPV6, IPV6_TCLASS, &kExpedited, sizeof kExpedited);
    constexpr int kNo = 0;
    (void)::setsockopt(socket, IPPROTO_IPV6, IPV6_V6ONLY, &kNo, sizeof kNo);
  }
  return socket;
}

}  // namespace

UdpPort::UdpPort(int socket) : socket_(socket) {}

UdpPort UdpPort::listening(const std::string& address) {
  const AddressList list = resolved(address, true, AF_UNSPEC, AI_PASSIVE);
  UdpPort port(open_socket(list->ai_family));
  if (port.socket_ < 0)
    throw refused(address, true, std::generic_category().message(errno), "check the network");
  if (::bind(port.socket_, list->ai_addr, list->ai_addrlen) != 0)
    throw refused(address, true, std::generic_category().message(errno),
                  "name an address of this machine and a port that no other program uses");
  return port;
}

UdpPort UdpPort::towards(const std::string& address) {
  // One socket for both families; a machine without IPv6 has only the other one.
  int family = AF_INET6;
  UdpPort port(open_socket(family));
  if (port.socket_ < 0) {
    family = AF_INET;
    port.socket_ = open_socket(family);
  }
  if (port.socket_ < 0)
    throw refused(address, false, std::generic_category().message(errno), "check the network");
  const int both = family == AF_INET6 ? AI_V4MAPPED | AI_ALL : 0;
  const AddressList list = resolved(address, false, family, both);
  for (const addrinfo* entry = list.get(); entry != nullptr; entry = entry->ai_next) {
    Address possible{.size = entry->ai_addrlen};
    std::memcpy(&possible.bytes, entry->ai_addr, entry->ai_addrlen);
    const auto same = [&](const Address& other) {
      return other.size == possible.size && std::memcmp(&other.bytes, &possible.bytes, other.size) == 0;
    };
    if (port.possible_.size() < kMaxAddresses && std::ranges::none_of(port.possible_, same))
      port.possible_.push_back(possible);
  }
  port.other_ = port.possible_.front();
  return port;
}

UdpPort::UdpPort(UdpPort&& other) noexcept
    : socket_(std::exchange(other.socket_, -1)),
      possible_(std::move(other.possible_)),
      other_(other.other_),
      sender_(other.sender_) {}

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
void UdpPort::send_to_all(std::span<const std::uint8_t> datagram) noexcept {
  for (const Address& possible : possible_) send_to(possible, datagram);
  if (possible_.empty()) send(datagram);
}
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
