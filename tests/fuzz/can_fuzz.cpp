// Input from a CAN socket besides telegrams: error frames, and the kernel's answer about the interface.
#include <linux/can/error.h>
#include <linux/can/netlink.h>
#include <linux/if_link.h>
#include <linux/netlink.h>
#include <linux/rtnetlink.h>

#include <algorithm>
#include <cstring>

#include "drivers/can/bus_error.h"
#include "drivers/can/interface_bitrate.h"
#include "tests/fuzz/fuzz_target.h"

namespace {

using drivers::can::BusError;
using drivers::can::decode_error_frame;
using fuzz::Bytes;
using fuzz::require;

template <typename T>
void append(Bytes& bytes, const T& value) {
  const auto* const first = reinterpret_cast<const std::uint8_t*>(&value);
  bytes.insert(bytes.end(), first, first + sizeof(T));
}

Bytes attribute(int type, const Bytes& content) {
  Bytes bytes;
  append(bytes, rtattr{static_cast<unsigned short>(sizeof(rtattr) + content.size()),
                       static_cast<unsigned short>(type)});
  bytes.insert(bytes.end(), content.begin(), content.end());
  bytes.resize(RTA_ALIGN(bytes.size()));
  return bytes;
}

Bytes link_message(std::uint32_t bitrate) {
  can_bittiming timing{};
  timing.bitrate = bitrate;
  Bytes content;
  append(content, timing);
  const Bytes info = attribute(IFLA_INFO_DATA | NLA_F_NESTED, attribute(IFLA_CAN_BITTIMING, content));
  Bytes bytes;
  nlmsghdr header{};
  header.nlmsg_type = RTM_NEWLINK;
  append(bytes, header);
  append(bytes, ifinfomsg{});
  const Bytes name = attribute(IFLA_IFNAME, {'c', 'a', 'n', '0', 0});
  bytes.insert(bytes.end(), name.begin(), name.end());
  const Bytes link_info = attribute(IFLA_LINKINFO, info);
  bytes.insert(bytes.end(), link_info.begin(), link_info.end());
  header.nlmsg_len = static_cast<std::uint32_t>(bytes.size());
  std::memcpy(bytes.data(), &header, sizeof header);
  return bytes;
}

}  // namespace

std::vector<Bytes> fuzz::seeds() {
  can_frame error{};
  error.can_id = CAN_ERR_FLAG | CAN_ERR_CRTL | CAN_ERR_PROT | CAN_ERR_TRX | CAN_ERR_ACK;
  error.can_dlc = CAN_ERR_DLC;
  Bytes frame;
  append(frame, error);
  return {link_message(1'000'000), link_message(0), frame};
}

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const Bytes bytes(data, data + size);
  const auto bitrate = drivers::can::bitrate_in(std::as_bytes(std::span(bytes)));
  require(!bitrate || *bitrate != 0);

  can_frame frame{};
  std::copy_n(bytes.begin(), std::min(sizeof frame, bytes.size()), reinterpret_cast<std::uint8_t*>(&frame));
  BusError error;
  const bool is_error = decode_error_frame(frame, error);
  require(is_error == ((frame.can_id & CAN_ERR_FLAG) != 0));
  require(is_error || error == BusError{});
  require(!error.any() || !describe(error).empty());
  return 0;
}
