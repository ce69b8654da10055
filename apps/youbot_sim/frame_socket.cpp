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
#include "drivers/ethercat/monotonic_clock.h"
#include "drivers/packet_age.h"
#include "drivers/uninterrupted.h"

namespace youbot_sim {
namespace {

using std::chrono::nanoseconds;

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
    // Optional: receive() also drops copies of our own frames.
    const int on = 1;
    setsockopt(socket_, SOL_PACKET, PACKET_IGNORE_OUTGOING, &on, sizeof on);
    drivers::stamp_packets(socket_);
    // Frames go to the master's address or to broadcast, seldom to ours.
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

FramePort::Frame FrameSocket::receive(std::span<std::uint8_t> buffer,
                                      std::chrono::nanoseconds timeout) noexcept {
  for (bool waited = false;; waited = true) {
    const Frame frame = take(buffer);
    if (frame.size > 0 || waited || timeout.count() <= 0) return frame;
    const timespec wait{timeout.count() / 1'000'000'000, timeout.count() % 1'000'000'000};
    pollfd readable{socket_, POLLIN, 0};
    if (ppoll(&readable, 1, &wait, nullptr) <= 0) return {};
  }
}

/// Reads a frame from the socket.
FramePort::Frame FrameSocket::take(std::span<std::uint8_t> buffer) noexcept {
  sockaddr_ll from{};
  iovec bytes{buffer.data(), buffer.size()};
  drivers::PacketStamp stamp;
  msghdr message{};
  message.msg_name = &from;
  message.msg_namelen = sizeof from;
  message.msg_iov = &bytes;
  message.msg_iovlen = 1;
  message.msg_control = stamp.bytes.data();
  message.msg_controllen = sizeof stamp.bytes;
  const ssize_t size = recvmsg(socket_, &message, 0);
  if (size <= 0 || from.sll_pkttype == PACKET_OUTGOING) return {};
  return {.size = static_cast<std::size_t>(size), .came = now() - drivers::packet_age(message)};
}

nanoseconds FrameSocket::now() const noexcept { return drivers::ethercat::monotonic_now(); }

bool FrameSocket::send(std::span<const std::uint8_t> frame) noexcept {
  const ssize_t sent = drivers::uninterrupted([&] { return ::send(socket_, frame.data(), frame.size(), 0); });
  return sent == static_cast<ssize_t>(frame.size());
}

}  // namespace youbot_sim
