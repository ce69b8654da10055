#include "drivers/ethercat/frame.h"

#include <algorithm>
#include <random>

namespace drivers::ethercat {
namespace {

constexpr std::uint16_t kLengthMask = 0x07FF;
constexpr std::uint16_t kMoreFollows = 0x8000;
constexpr std::uint16_t kTypeDatagrams = 1;
constexpr std::size_t kLengthOffset = 6;  // within a datagram's header

}  // namespace

MacAddress unique_master_mac() {
  std::random_device random;
  MacAddress address = kMasterMac;
  for (std::size_t i = address.size() / 2; i < address.size(); ++i)
    address[i] = static_cast<std::uint8_t>(random());
  return address;
}

void FrameWriter::clear() noexcept {
  std::copy(kBroadcast.begin(), kBroadcast.end(), buffer_.begin());
  std::copy(source_.begin(), source_.end(), buffer_.begin() + kSourceMacOffset);
  buffer_[12] = kEtherType >> 8;
  buffer_[13] = kEtherType & 0xFF;
  size_ = kFrameHeaderBytes;
  last_ = 0;
}

std::size_t FrameWriter::free_bytes() const noexcept {
  const std::size_t used = size_ + kDatagramOverheadBytes;
  return used < kMaxFrameBytes ? kMaxFrameBytes - used : 0;
}

Datagram FrameWriter::add(Command command, std::uint8_t index, std::uint32_t address,
                          std::size_t length) noexcept {
  if (size_ + kDatagramOverheadBytes > kMaxFrameBytes || length > free_bytes()) return {};
  if (last_ != 0) {
    std::uint8_t* const previous = &buffer_[last_ + kLengthOffset];
    store_le<std::uint16_t>(previous, load_le<std::uint16_t>(previous) | kMoreFollows);
  }
  last_ = size_;
  std::uint8_t* const header = &buffer_[size_];
  header[0] = static_cast<std::uint8_t>(command);
  header[1] = index;
  store_le(header + 2, address);
  store_le(header + kLengthOffset, static_cast<std::uint16_t>(length));
  store_le<std::uint16_t>(header + 8, 0);
  std::fill_n(header + kDatagramHeaderBytes, length + kCounterBytes, std::uint8_t{0});
  size_ += kDatagramOverheadBytes + length;
  return {.command = command,
          .index = index,
          .address = address,
          .data = {header + kDatagramHeaderBytes, length},
          .header = header,
          .counter = header + kDatagramHeaderBytes + length};
}

std::span<const std::uint8_t> FrameWriter::bytes() noexcept {
  store_le(&buffer_[kEthernetHeaderBytes],
           static_cast<std::uint16_t>(kTypeDatagrams << 12 | (size_ - kFrameHeaderBytes)));
  const std::size_t padded = std::max(size_, kMinFrameBytes);
  std::fill(buffer_.begin() + static_cast<std::ptrdiff_t>(size_),
            buffer_.begin() + static_cast<std::ptrdiff_t>(padded), std::uint8_t{0});
  return {buffer_.data(), padded};
}

FrameError FrameReader::parse(std::span<std::uint8_t> frame) noexcept {
  frame_ = frame;
  position_ = end_ = 0;
  if (frame.size() < kFrameHeaderBytes) return FrameError::kTooShort;
  if ((frame[12] << 8 | frame[13]) != kEtherType) return FrameError::kNotEthercat;
  const auto header = load_le<std::uint16_t>(&frame[kEthernetHeaderBytes]);
  if (header >> 12 != kTypeDatagrams) return FrameError::kNotDatagrams;
  const std::size_t end = kFrameHeaderBytes + (header & kLengthMask);
  if (end > frame.size()) return FrameError::kTruncated;

  std::size_t position = kFrameHeaderBytes;
  for (bool more = true; more;) {
    if (position + kDatagramOverheadBytes > end) return FrameError::kTruncated;
    if (frame[position] > kHighestCommand) return FrameError::kUnknownCommand;
    const auto length = load_le<std::uint16_t>(&frame[position + kLengthOffset]);
    position += kDatagramOverheadBytes + (length & kLengthMask);
    if (position > end) return FrameError::kTruncated;
    more = (length & kMoreFollows) != 0;
  }
  if (position != end) return FrameError::kLengthMismatch;
  position_ = kFrameHeaderBytes;
  end_ = end;
  return FrameError::kNone;
}

bool FrameReader::next(Datagram& datagram) noexcept {
  if (position_ >= end_) return false;
  std::uint8_t* const header = &frame_[position_];
  const std::size_t length = load_le<std::uint16_t>(header + kLengthOffset) & kLengthMask;
  datagram = {.command = static_cast<Command>(header[0]),
              .index = header[1],
              .address = load_le<std::uint32_t>(header + 2),
              .interrupt = load_le<std::uint16_t>(header + 8),
              .data = {header + kDatagramHeaderBytes, length},
              .header = header,
              .counter = header + kDatagramHeaderBytes + length};
  position_ += kDatagramOverheadBytes + length;
  return true;
}

const char* describe(FrameError error) noexcept {
  switch (error) {
    case FrameError::kNone: return "no error";
    case FrameError::kTooShort: return "too short for its headers";
    case FrameError::kNotEthercat: return "not EtherCAT";
    case FrameError::kNotDatagrams: return "EtherCAT, but not datagrams";
    case FrameError::kTruncated: return "a length points beyond its end";
    case FrameError::kUnknownCommand: return "an unknown command";
    case FrameError::kLengthMismatch: return "datagrams and header disagree on the length";
  }
  return "an unknown error";
}

}  // namespace drivers::ethercat
