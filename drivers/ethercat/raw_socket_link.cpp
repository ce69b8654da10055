#include "drivers/ethercat/raw_socket_link.h"

#include <arpa/inet.h>
#include <linux/if_packet.h>
#include <net/if.h>
#include <poll.h>
#include <sys/ioctl.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <utility>

#include "drivers/ethercat/bus_error.h"
#include "drivers/ethercat/frame.h"
#include "drivers/ethercat/monotonic_clock.h"
#include "drivers/ethercat/other_master.h"
#include "drivers/packet_age.h"
#include "drivers/uninterrupted.h"

namespace drivers::ethercat {
namespace {

using std::chrono::nanoseconds;

/// An active master sends at 30 Hz or faster.
constexpr std::chrono::milliseconds kListening{100};

[[noreturn]] void fail(const std::string& interface, const char* step, int error) {
  const char* hint = "";
  if (error == EPERM || error == EACCES)
    hint = "; give the program CAP_NET_RAW (setcap cap_net_raw+ep) or run it as root";
  if (error == ENODEV) hint = "; 'ip link' lists the interfaces there are";
  throw BusError(interface, step, std::strerror(error) + std::string(hint));
}

/// Closes the descriptor unless the constructor succeeds.
struct Descriptor {
  int value;
  ~Descriptor() {
    if (value >= 0) close(value);
  }
  int release() { return std::exchange(value, -1); }
};

}  // namespace

RawSocketLink::RawSocketLink(const std::string& interface, Wait wait) : interface_(interface), wait_(wait) {
  if (interface.empty() || interface.size() >= IFNAMSIZ)
    throw BusError("'" + interface + "'", "open", "not the name of a network interface");
  Descriptor descriptor{socket(AF_PACKET, SOCK_RAW | SOCK_CLOEXEC, 0)};
  if (descriptor.value < 0) fail(interface, "open a raw socket", errno);

  ifreq request{};
  std::memcpy(request.ifr_name, interface.c_str(), interface.size());
  if (ioctl(descriptor.value, SIOCGIFINDEX, &request) != 0) fail(interface, "find the interface", errno);
  const int index = request.ifr_ifindex;
  if (ioctl(descriptor.value, SIOCGIFFLAGS, &request) != 0)
    fail(interface, "read the interface's flags", errno);
  if ((request.ifr_flags & IFF_UP) == 0)
    throw BusError(interface, "open", "the interface is down; 'ip link set " + interface + " up'");
  lock_.emplace(interface, index, InterfaceLock::End::kEthercatMaster);

  // Otherwise our own frames return as outgoing copies; and a queueing discipline only delays frames. Both
  // are hints: an older kernel without them works too, because receive() drops outgoing copies itself.
  const int on = 1;
  setsockopt(descriptor.value, SOL_PACKET, PACKET_IGNORE_OUTGOING, &on, sizeof on);
  setsockopt(descriptor.value, SOL_PACKET, PACKET_QDISC_BYPASS, &on, sizeof on);
  stamp_packets(descriptor.value);

  // Bound last, with the protocol, so that frames of another interface are never queued.
  sockaddr_ll address{};
  address.sll_family = AF_PACKET;
  address.sll_protocol = htons(kEtherType);
  address.sll_ifindex = index;
  if (bind(descriptor.value, reinterpret_cast<const sockaddr*>(&address), sizeof address) != 0)
    fail(interface, "bind to the interface", errno);
  socket_ = descriptor.value;
  refuse_other_masters();
  (void)descriptor.release();
}

RawSocketLink::~RawSocketLink() { close(socket_); }

/// Nothing has been sent from here yet, so every received frame is another master's.
void RawSocketLink::refuse_other_masters() {
  OtherMaster other;
  std::array<std::uint8_t, kMaxFrameBytes> buffer{};
  const nanoseconds deadline = monotonic_now() + kListening;
  for (nanoseconds now = monotonic_now(); now < deadline; now = monotonic_now()) {
    if (receive(buffer, deadline - now) < kFrameHeaderBytes) continue;
    MacAddress source;
    std::copy_n(buffer.begin() + kSourceMacOffset, source.size(), source.begin());
    other.note_frame(source, monotonic_now());
  }
  if (other.present(monotonic_now())) throw AnotherMaster(interface_, "listen for 0.1 s", other.describe());
}

bool RawSocketLink::send(std::span<const std::uint8_t> frame) noexcept {
  if (std::exchange(reply_is_due_, false)) reply_wait_.lost();
  sent_at_ = monotonic_now();
  const ssize_t sent =
      uninterrupted([&] { return ::send(socket_, frame.data(), frame.size(), MSG_DONTWAIT); });
  if (sent == static_cast<ssize_t>(frame.size())) {
    reply_is_due_ = wait_ == Wait::kBlock;
    return true;
  }
  last_error_ = sent < 0 ? errno : EIO;
  return false;
}

void RawSocketLink::sleep(nanoseconds duration) noexcept {
  const timespec wait{duration.count() / 1'000'000'000, duration.count() % 1'000'000'000};
  pollfd readable{socket_, POLLIN, 0};
  ppoll(&readable, 1, &wait, nullptr);
}

void RawSocketLink::learn(nanoseconds blocked_since) noexcept {
  const nanoseconds now = monotonic_now();
  if (blocked_since.count() > 0) reply_wait_.woke(std::min(frame_age_, now - blocked_since));
  if (!std::exchange(reply_is_due_, false)) return;
  const nanoseconds passed = now - sent_at_;
  reply_wait_.replied(passed - std::min(frame_age_, passed));
}

std::size_t RawSocketLink::receive(std::span<std::uint8_t> buffer, nanoseconds timeout) noexcept {
  nanoseconds now = monotonic_now();
  const nanoseconds deadline = now + timeout;
  ReplyWait::Plan plan = reply_is_due_ ? reply_wait_.plan() : ReplyWait::Plan{};
  const nanoseconds wake = std::min(sent_at_ + plan.asleep, deadline);
  if (plan.polls && now < wake) {
    sleep(wake - now);
    now = monotonic_now();
    if (now > wake) reply_wait_.woke(now - wake);
  }
  const nanoseconds poll_until = now + ReplyWait::kMaxPolling;
  nanoseconds blocked_since{};
  for (;;) {
    sockaddr_ll from{};
    iovec bytes{buffer.data(), buffer.size()};
    PacketStamp stamp;
    msghdr message{};
    message.msg_name = &from;
    message.msg_namelen = sizeof from;
    message.msg_iov = &bytes;
    message.msg_iovlen = 1;
    message.msg_control = stamp.bytes.data();
    message.msg_controllen = sizeof stamp.bytes;
    const ssize_t size = recvmsg(socket_, &message, MSG_DONTWAIT);
    if (size > 0 && from.sll_pkttype != PACKET_OUTGOING) {
      frame_age_ = packet_age(message);
      if (plan.polls) reply_wait_.polled(true);
      learn(blocked_since);
      return static_cast<std::size_t>(size);
    }
    if (size < 0 && errno != EAGAIN && errno != EINTR) last_error_ = errno;  // e.g. ENETDOWN, reported once

    now = monotonic_now();
    if (now >= deadline) return 0;
    if (wait_ == Wait::kBusy || size >= 0) continue;
    if (plan.polls) {
      if (now < poll_until) continue;
      plan.polls = false;
      reply_wait_.polled(false);
    }
    blocked_since = now;
    sleep(deadline - now);
  }
}

}  // namespace drivers::ethercat
