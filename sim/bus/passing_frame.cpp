#include "sim/bus/passing_frame.h"

namespace sim::bus {
namespace {

using drivers::ethercat::kCounterBytes;
using drivers::ethercat::kDatagramHeaderBytes;
using drivers::ethercat::load_le;

constexpr std::size_t kEtherTypeOffset = 12;
constexpr std::uint16_t kVlanTag = 0x8100;
constexpr std::size_t kVlanTagBytes = 4;
constexpr std::size_t kHeaderBytes = 2;
constexpr std::uint16_t kTypeDatagrams = 1;
// Length field of a datagram: length, and whether more follow.
constexpr std::size_t kLengthOffset = 6;
constexpr std::uint16_t kLengthMask = 0x07FF;
constexpr std::uint16_t kMoreFollows = 0x8000;

unsigned ether_type(std::span<const std::uint8_t> frame, std::size_t at) noexcept {
  return at + 2 <= frame.size() ? static_cast<unsigned>(frame[at] << 8 | frame[at + 1]) : 0U;
}

}  // namespace

void PassingFrame::look_at(std::span<std::uint8_t> frame) noexcept {
  count_ = 0;
  valid_ = false;
  if (frame.size() > drivers::ethercat::kMaxFrameBytes) return;
  std::size_t at = kEtherTypeOffset;
  if (ether_type(frame, at) == kVlanTag) at += kVlanTagBytes;
  if (ether_type(frame, at) != drivers::ethercat::kEtherType) return;
  at += 2;
  if (at + kHeaderBytes > frame.size() || load_le<std::uint16_t>(&frame[at]) >> 12 != kTypeDatagrams) return;
  at += kHeaderBytes;

  for (bool more = true; more;) {
    if (at + kDatagramHeaderBytes + kCounterBytes > frame.size()) return;
    std::uint8_t* const header = &frame[at];
    const auto field = load_le<std::uint16_t>(header + kLengthOffset);
    const std::size_t length = field & kLengthMask;
    at += kDatagramHeaderBytes + length + kCounterBytes;
    if (at > frame.size()) return;
    datagrams_[count_++] = {.command = static_cast<drivers::ethercat::Command>(header[0]),
                            .index = header[1],
                            .address = load_le<std::uint32_t>(header + 2),
                            .interrupt = load_le<std::uint16_t>(header + 8),
                            .data = {header + kDatagramHeaderBytes, length},
                            .header = header,
                            .counter = header + kDatagramHeaderBytes + length};
    more = (field & kMoreFollows) != 0;
  }
  valid_ = true;
}

}  // namespace sim::bus
