/// @file
/// Time that a packet waited in its socket.
#pragma once
#include <sys/socket.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cstring>
#include <ctime>

namespace drivers {

/// Asks the kernel to stamp each received packet. Best effort: without stamps packet_age() is zero.
inline void stamp_packets(int socket) noexcept {
  const int on = 1;
  setsockopt(socket, SOL_SOCKET, SO_TIMESTAMPNS, &on, sizeof on);
}

/// Buffer for the kernel's stamp of one packet.
struct PacketStamp {
  alignas(cmsghdr) std::array<char, CMSG_SPACE(sizeof(timespec))> bytes{};
};

/// Age of the packet that recvmsg() has just returned, with a PacketStamp as control data.
inline std::chrono::nanoseconds packet_age(const msghdr& message) noexcept {
  const cmsghdr* const header = CMSG_FIRSTHDR(&message);
  if (header == nullptr || header->cmsg_level != SOL_SOCKET || header->cmsg_type != SCM_TIMESTAMPNS)
    return {};
  timespec came{};
  std::memcpy(&came, CMSG_DATA(header), sizeof came);
  // The kernel stamps with the wall clock. If it is set back meanwhile, the age is too small, at least zero;
  // if it is set forward, too large: callers limit the age to the time since their request.
  timespec now{};
  clock_gettime(CLOCK_REALTIME, &now);
  const auto age =
      std::chrono::seconds(now.tv_sec - came.tv_sec) + std::chrono::nanoseconds(now.tv_nsec - came.tv_nsec);
  return std::max(age, std::chrono::nanoseconds(0));
}

}  // namespace drivers
