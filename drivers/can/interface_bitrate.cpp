#include "drivers/can/interface_bitrate.h"

#include <linux/can/netlink.h>
#include <linux/if_link.h>
#include <linux/netlink.h>
#include <linux/rtnetlink.h>
#include <sys/socket.h>
#include <sys/time.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cstring>

namespace drivers::can {
namespace {

using Bytes = std::span<const std::byte>;

template <typename T>
std::optional<T> read(Bytes bytes) noexcept {
  if (bytes.size() < sizeof(T)) return std::nullopt;
  T value;
  std::memcpy(&value, bytes.data(), sizeof(T));
  return value;
}

// Content of the first attribute of this type; empty if there is none. rtnetlink(7): length, type, data,
// padding to four bytes.
Bytes attribute(Bytes bytes, unsigned type) noexcept {
  while (const auto header = read<rtattr>(bytes)) {
    const std::size_t length = header->rta_len;
    if (length < sizeof(rtattr) || length > bytes.size()) return {};
    if ((header->rta_type & NLA_TYPE_MASK) == type)
      return bytes.subspan(sizeof(rtattr), length - sizeof(rtattr));
    bytes = bytes.subspan(std::min(bytes.size(), RTA_ALIGN(length)));
  }
  return {};
}

}  // namespace

std::optional<std::uint32_t> bitrate_in(Bytes link_message) noexcept {
  const auto header = read<nlmsghdr>(link_message);
  constexpr std::size_t kAttributesAt = NLMSG_LENGTH(NLMSG_ALIGN(sizeof(ifinfomsg)));
  if (!header || header->nlmsg_type != RTM_NEWLINK || link_message.size() < kAttributesAt)
    return std::nullopt;
  const std::size_t length = std::min<std::size_t>(header->nlmsg_len, link_message.size());
  if (length < kAttributesAt) return std::nullopt;
  const Bytes link_info = attribute(link_message.first(length).subspan(kAttributesAt), IFLA_LINKINFO);
  const Bytes can_info = attribute(link_info, IFLA_INFO_DATA);
  const auto timing = read<can_bittiming>(attribute(can_info, IFLA_CAN_BITTIMING));
  if (!timing || timing->bitrate == 0) return std::nullopt;
  return timing->bitrate;
}

std::optional<std::uint32_t> interface_bitrate(unsigned interface_index) noexcept {
  const int fd = ::socket(AF_NETLINK, SOCK_RAW | SOCK_CLOEXEC, NETLINK_ROUTE);
  if (fd < 0) return std::nullopt;
  struct {
    nlmsghdr header;
    ifinfomsg info;
  } request{};
  request.header.nlmsg_len = sizeof(request);
  request.header.nlmsg_type = RTM_GETLINK;
  request.header.nlmsg_flags = NLM_F_REQUEST;
  request.info.ifi_index = static_cast<int>(interface_index);

  timeval patience{1, 0};  // the kernel answers at once; time-out for a defective one
  ::setsockopt(fd, SOL_SOCKET, SO_RCVTIMEO, &patience, sizeof(patience));
  std::array<std::byte, 16384> answer{};
  ssize_t size = ::send(fd, &request, sizeof(request), 0);
  if (size >= 0) size = ::recv(fd, answer.data(), answer.size(), 0);
  ::close(fd);
  if (size <= 0) return std::nullopt;
  return bitrate_in(std::span(answer).first(static_cast<std::size_t>(size)));
}

}  // namespace drivers::can
