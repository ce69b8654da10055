#include "drivers/can/socket_can.h"

#include <linux/can/error.h>
#include <linux/can/raw.h>
#include <net/if.h>
#include <net/if_arp.h>
#include <poll.h>
#include <sys/ioctl.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <system_error>
#include <utility>

#include "drivers/can/interface_bitrate.h"
#include "drivers/packet_age.h"
#include "drivers/uninterrupted.h"

namespace drivers::can {
namespace {

using std::chrono::nanoseconds;

std::string words(int error) {
  return std::generic_category().message(error) + " (errno " + std::to_string(error) + ")";
}

ifreq request_for(const std::string& interface) noexcept {
  ifreq request{};
  interface.copy(request.ifr_name, IFNAMSIZ - 1);
  return request;
}

nanoseconds now() noexcept { return std::chrono::steady_clock::now().time_since_epoch(); }

int open_socket(const SocketCanOptions& options) {
  const int socket = ::socket(PF_CAN, SOCK_RAW | SOCK_NONBLOCK | SOCK_CLOEXEC, CAN_RAW);
  if (socket < 0) throw open_error(OpenStep::kSocket, errno, options);
  return socket;
}

}  // namespace

SetupError open_error(OpenStep step, int error, const SocketCanOptions& options,
                      std::uint32_t found_bit_per_s) {
  const std::string& name = options.interface;
  const std::string rate =
      std::to_string(options.bitrate_bit_per_s != 0 ? options.bitrate_bit_per_s : 1'000'000);
  const std::string set_up = "sudo ip link set " + name + " up type can bitrate " + rate;
  const bool denied = error == EPERM || error == EACCES;
  switch (step) {
    case OpenStep::kSocket:
      if (denied) {
        return SetupError(
            {name, "open a CAN socket", "permission", words(error),
             "in a container, allow the address family PF_CAN (seccomp, RestrictAddressFamilies)"});
      }
      return SetupError({name, "open a CAN socket", "a kernel with PF_CAN", words(error),
                         "load it: sudo modprobe -a can can_raw; if that fails this kernel is built without "
                         "CONFIG_CAN and CONFIG_CAN_RAW"});
    case OpenStep::kFind:
      return SetupError(
          {name, "find the interface", "a network interface of this name", words(error),
           "list them with: ip -details link; plug in the adapter and load its kernel module, or "
           "name another interface"});
    case OpenStep::kNotCan:
      return SetupError({name, "check the interface", "a CAN interface", "another kind of network interface",
                         "list CAN interfaces with: ip -details link show type can"});
    case OpenStep::kDown:
      return SetupError({name, "check the interface", "it up", "it down", "set it up: " + set_up});
    case OpenStep::kBitrate:
      return SetupError(
          {name, "check the bit rate", rate + " bit/s", std::to_string(found_bit_per_s) + " bit/s",
           "sudo ip link set " + name + " down; " + set_up + "; or configure the rate the module has"});
    case OpenStep::kOptions:
      return SetupError(
          {name, "set the receive filter", "success", words(error), "report this: it should not fail"});
    case OpenStep::kBind: break;
  }
  return SetupError(
      {name, "bind to the interface", "success", words(error),
       denied ? "run as a user who may use it" : "check that the interface is still there and up"});
}

// After the delegated constructor, the destructor closes the socket, even if this one throws.
SocketCan::SocketCan(const SocketCanOptions& options) : SocketCan(open_socket(options), options.interface) {
  const auto check = [&options](bool ok, OpenStep step) {
    if (!ok) throw open_error(step, errno, options);
  };
  errno = ENODEV;
  check(!name_.empty() && name_.size() < IFNAMSIZ, OpenStep::kFind);
  ifreq request = request_for(name_);
  check(::ioctl(socket_, SIOCGIFINDEX, &request) == 0, OpenStep::kFind);
  const int index = request.ifr_ifindex;

  request = request_for(name_);
  check(::ioctl(socket_, SIOCGIFHWADDR, &request) == 0 && request.ifr_hwaddr.sa_family == ARPHRD_CAN,
        OpenStep::kNotCan);
  request = request_for(name_);
  check(::ioctl(socket_, SIOCGIFFLAGS, &request) == 0 && (request.ifr_flags & IFF_UP) != 0, OpenStep::kDown);

  const auto bitrate = interface_bitrate(static_cast<unsigned>(index));
  if (options.bitrate_bit_per_s != 0 && bitrate && *bitrate != options.bitrate_bit_per_s) {
    throw open_error(OpenStep::kBitrate, 0, options, *bitrate);
  }

  // Replies do not identify the requester.
  lock_.emplace(name_, index, InterfaceLock::End::kCanMaster);

  // Exactly this identifier: no extended ones, no remote requests. Error frames have their own filter.
  const can_filter filter{options.receive_id & CAN_SFF_MASK, CAN_SFF_MASK | CAN_EFF_FLAG | CAN_RTR_FLAG};
  const can_err_mask_t errors = CAN_ERR_MASK;
  check(::setsockopt(socket_, SOL_CAN_RAW, CAN_RAW_FILTER, &filter, sizeof(filter)) == 0, OpenStep::kOptions);
  check(::setsockopt(socket_, SOL_CAN_RAW, CAN_RAW_ERR_FILTER, &errors, sizeof(errors)) == 0,
        OpenStep::kOptions);

  sockaddr_can address{};
  address.can_family = AF_CAN;
  address.can_ifindex = index;
  stamp_packets(socket_);
  check(::bind(socket_, reinterpret_cast<const sockaddr*>(&address), sizeof(address)) == 0, OpenStep::kBind);
}

SocketCan::SocketCan(int socket, std::string name) noexcept : socket_(socket), name_(std::move(name)) {}

SocketCan::SocketCan(SocketCan&& other) noexcept
    : socket_(std::exchange(other.socket_, -1)),
      name_(std::move(other.name_)),
      lock_(std::move(other.lock_)),
      bus_error_(other.bus_error_),
      last_error_(other.last_error_),
      frame_age_(other.frame_age_) {}

SocketCan& SocketCan::operator=(SocketCan&& other) noexcept {
  std::swap(socket_, other.socket_);
  std::swap(name_, other.name_);
  std::swap(lock_, other.lock_);
  std::swap(bus_error_, other.bus_error_);
  std::swap(last_error_, other.last_error_);
  std::swap(frame_age_, other.frame_age_);
  return *this;
}

SocketCan::~SocketCan() {
  if (socket_ >= 0) ::close(socket_);
}

bool SocketCan::wait_for(short events, nanoseconds timeout) noexcept {
  const nanoseconds deadline = now() + timeout;
  while (true) {
    const nanoseconds left = std::max(deadline - now(), nanoseconds(0));
    const auto seconds = std::chrono::duration_cast<std::chrono::seconds>(left);
    const timespec wait{static_cast<time_t>(seconds.count()), static_cast<long>((left - seconds).count())};
    pollfd entry{socket_, events, 0};
    const int ready = ::ppoll(&entry, 1, &wait, nullptr);
    if (ready > 0) return true;  // also an error condition: the next call returns it
    if (ready == 0 || errno != EINTR) return false;
  }
}

bool SocketCan::send(const can_frame& frame, nanoseconds timeout) noexcept {
  for (bool waited = false;; waited = true) {
    // No SIGPIPE if the other end of a test's socket pair is closed.
    const ssize_t sent =
        uninterrupted([&] { return ::send(socket_, &frame, sizeof(frame), MSG_DONTWAIT | MSG_NOSIGNAL); });
    if (sent == sizeof(frame)) return true;
    last_error_ = sent < 0 ? errno : EMSGSIZE;
    const bool full = last_error_ == EAGAIN || last_error_ == EWOULDBLOCK;
    if (!full || waited || timeout <= nanoseconds(0) || !wait_for(POLLOUT, timeout)) return false;
  }
}

Received SocketCan::receive(can_frame& frame, nanoseconds timeout) noexcept {
  for (bool waited = false;; waited = true) {
    can_frame incoming{};
    iovec bytes{&incoming, sizeof(incoming)};
    PacketStamp stamp;
    msghdr message{};
    message.msg_iov = &bytes;
    message.msg_iovlen = 1;
    message.msg_control = stamp.bytes.data();
    message.msg_controllen = sizeof stamp.bytes;
    const ssize_t size = ::recvmsg(socket_, &message, MSG_DONTWAIT);
    if (size == sizeof(incoming)) {
      frame_age_ = packet_age(message);
      if (decode_error_frame(incoming, bus_error_)) return Received::kBusError;
      if (incoming.can_dlc <= CAN_MAX_DLEN) {
        frame = incoming;
        return Received::kFrame;
      }
    }
    if (size >= 0) {
      last_error_ = size == 0 ? ECONNRESET : EBADMSG;
      return Received::kFailed;
    }
    if (errno != EAGAIN && errno != EWOULDBLOCK && errno != EINTR) {
      last_error_ = errno;
      return Received::kFailed;
    }
    if (waited || timeout <= nanoseconds(0) || !wait_for(POLLIN, timeout)) return Received::kNothing;
  }
}

}  // namespace drivers::can
