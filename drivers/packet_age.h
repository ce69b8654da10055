/// @file
/// How long a packet has lain in its socket.
#pragma once
#include <sys/socket.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cstring>
#include <ctime>

namespace drivers {

/// The kernel is to say when each packet came in. A hint: where it does not, packet_age() is zero.
inline void stamp_packets(int socket) noexcept {
  const int on = 1;
  setsockopt(socket, SOL_SOCKET, SO_TIMESTAMPNS, &on, sizeof on);
}

/// For the kernel's stamp of one packet.
struct PacketStamp {
  alignas(cmsghdr) std::array<char, CMSG_SPACE(sizeof(timespec))> bytes{};
};

/// Of the packet that recvmsg() has just given, with a PacketStamp as control data.
inline std::chrono::nanoseconds packet_age(const msghdr& message) noexcept {
  const cmsghdr* const header = CMSG_FIRSTHDR(&message);
  if (header == nullptr || header->cmsg_level != SOL_SOCKET || header->cmsg_type != SCM_TIMESTAMPNS)
    return {};
  timespec came{};
  std::memcpy(&came, CMSG_DATA(header), sizeof came);
  // The kernel stamps with the wall clock. When that is set back in between, the age comes out too small, at
  // least zero; when it is set forward, too large: callers cut the age to the time since they asked.
  timespec now{};
  clock_gettime(CLOCK_REALTIME, &now);
  const auto age =
      std::chrono::seconds(now.tv_sec - came.tv_sec) + std::chrono::nanoseconds(now.tv_nsec - came.tv_nsec);
  return std::max(age, std::chrono::nanoseconds(0));
}

}  // namespace drivers
