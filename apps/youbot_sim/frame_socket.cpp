#include "apps/youbot_sim/frame_socket.h"

#include <arpa/inet.h>
#include <linux/if_packet.h>
#include <net/if.h>
#include <poll.h>
#include <sys/ioctl.h>
#include <sys/socket.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <stdexcept>

#include "drivers/ethercat/frame.h"

namespace youbot_sim {
namespace {

[[noreturn]] void fail(const std::string& interface, const char* step, const std::string& problem) {
  throw std::runtime_error(interface + ": " + step + ": " + problem);
}

std::string words(int error) {
  std::string text = std::strerror(error);
  if (error == EPERM || error == EACCES)
    return text + "; give the program CAP_NET_RAW (setcap cap_net_raw+ep) or run it as root";
  if (error == ENODEV) return text + "; 'ip link' lists the interfaces there are";
  return text;
}

/// Returns the interface's index.
int prepare(int descriptor, const std::string& interface) {
  if (interface.empty() || interface.size() >= IFNAMSIZ)
    fail("'" + interface + "'", "open", "not the name of a network interface");
  ifreq request{};
  std::memcpy(request.ifr_name, interface.c_str(), interface.size());
  if (ioctl(descriptor, SIOCGIFINDEX, &request) != 0) fail(interface, "find the interface", words(errno));
  const int index = request.ifr_ifindex;
  if (ioctl(descriptor, SIOCGIFFLAGS, &request) != 0) fail(interface, "read its flags", words(errno));
  if ((request.ifr_flags & IFF_UP) == 0)
    fail(interface, "open", "the interface is down; 'ip link set " + interface + " up'");
  return index;
}

}  // namespace

FrameSocket::FrameSocket(const std::string& interface)
    : socket_(socket(AF_PACKET, SOCK_RAW | SOCK_CLOEXEC | SOCK_NONBLOCK, 0)) {
  if (socket_ < 0) fail(interface, "open a raw socket", words(errno));
  try {
    sockaddr_ll address{};
    address.sll_family = AF_PACKET;
    address.sll_protocol = htons(drivers::ethercat::kEtherType);
    address.sll_ifindex = prepare(socket_, interface);
    lock_.emplace(interface, address.sll_ifindex, drivers::InterfaceLock::End::kEthercatSlaves);
    // A hint: receive() drops copies of our own frames too.
    const int on = 1;
    setsockopt(socket_, SOL_PACKET, PACKET_IGNORE_OUTGOING, &on, sizeof on);
    // Frames go to the master's address or to everybody, seldom to ours.
    packet_mreq everything{};
    everything.mr_ifindex = address.sll_ifindex;
    everything.mr_type = PACKET_MR_PROMISC;
    setsockopt(socket_, SOL_PACKET, PACKET_ADD_MEMBERSHIP, &everything, sizeof everything);
    if (bind(socket_, reinterpret_cast<const sockaddr*>(&address), sizeof address) != 0)
      fail(interface, "bind to the interface", words(errno));
  } catch (...) {
    close(socket_);
    throw;
  }
}

FrameSocket::~FrameSocket() { close(socket_); }

std::size_t FrameSocket::receive(std::span<std::uint8_t> buffer, std::chrono::nanoseconds timeout) noexcept {
  for (bool waited = false;; waited = true) {
    sockaddr_ll from{};
    socklen_t from_size = sizeof from;
    const ssize_t size =
        recvfrom(socket_, buffer.data(), buffer.size(), 0, reinterpret_cast<sockaddr*>(&from), &from_size);
    if (size > 0 && from.sll_pkttype != PACKET_OUTGOING) return static_cast<std::size_t>(size);
    if (waited || timeout.count() <= 0) return 0;
    const timespec wait{timeout.count() / 1'000'000'000, timeout.count() % 1'000'000'000};
    pollfd readable{socket_, POLLIN, 0};
    if (ppoll(&readable, 1, &wait, nullptr) <= 0) return 0;
  }
}

bool FrameSocket::send(std::span<const std::uint8_t> frame) noexcept {
  return ::send(socket_, frame.data(), frame.size(), 0) == static_cast<ssize_t>(frame.size());
}

}  // namespace youbot_sim
