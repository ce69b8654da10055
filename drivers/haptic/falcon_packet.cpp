#include "drivers/haptic/falcon_packet.h"

#include <algorithm>
#include <cstdlib>

namespace drivers::haptic::falcon {
namespace {

constexpr std::uint8_t kStart = '<';
constexpr std::uint8_t kEnd = '>';
constexpr std::uint8_t kZero = 'A';
constexpr std::size_t kStateByte = 13;
constexpr std::size_t kUnusedByte = 14;
constexpr std::size_t kEndByte = 15;

constexpr unsigned kHomingBit = 0;
constexpr unsigned kGreenBit = 1;
constexpr unsigned kBlueBit = 2;
constexpr unsigned kRedBit = 3;

constexpr unsigned kButtonMask = 0x0F;
constexpr unsigned kHomedShift = 4;

constexpr std::size_t first_nibble(std::size_t axis) noexcept { return 1 + 4 * axis; }

bool belongs_at(std::size_t position, std::uint8_t byte) noexcept {
  if (position == 0) return byte == kStart;
  if (position == kEndByte) return byte == kEnd;
  if (position == kStateByte) return byte >= kZero && byte - kZero <= 0x7F;
  if (position == kUnusedByte) return byte >= kZero;  // nobody says what a device puts there
  return byte >= kZero && byte - kZero <= 0x0F;
}

}  // namespace

std::array<std::int32_t, kAxes> within_motor_limit(const std::array<std::int32_t, kAxes>& motors) noexcept {
  std::int64_t largest = 0;
  for (const std::int64_t motor : motors) largest = std::max(largest, std::abs(motor));
  if (largest <= kMotorLimit) return motors;
  std::array<std::int32_t, kAxes> scaled{};
  std::transform(motors.begin(), motors.end(), scaled.begin(), [largest](std::int64_t motor) {
    return static_cast<std::int32_t>(motor * kMotorLimit / largest);
  });
  return scaled;
}

Packet encode(const Command& command) noexcept {
  Packet packet{};
  packet.fill(kZero);
  packet.front() = kStart;
  packet.back() = kEnd;
  const auto motors = within_motor_limit(command.motors);
  for (std::size_t axis = 0; axis < kAxes; ++axis) {
    const auto bits = static_cast<std::uint32_t>(motors[axis]);
    for (std::size_t i = 0; i < 4; ++i) {
      packet[first_nibble(axis) + i] = static_cast<std::uint8_t>(kZero + (bits >> (4 * i) & 0xFU));
    }
  }
  const unsigned state = static_cast<unsigned>(command.homing) << kHomingBit |
                         static_cast<unsigned>(command.leds.green) << kGreenBit |
                         static_cast<unsigned>(command.leds.blue) << kBlueBit |
                         static_cast<unsigned>(command.leds.red) << kRedBit;
  packet[kStateByte] = static_cast<std::uint8_t>(kZero + state);
  return packet;
}

std::optional<Reply> decode_reply(std::span<const std::uint8_t> bytes) noexcept {
  if (bytes.size() != kPacketBytes) return std::nullopt;
  for (std::size_t i = 0; i < kPacketBytes; ++i) {
    if (!belongs_at(i, bytes[i])) return std::nullopt;
  }
  Reply reply;
  for (std::size_t axis = 0; axis < kAxes; ++axis) {
    unsigned bits = 0;
    for (std::size_t i = 0; i < 4; ++i) {
      bits |= static_cast<unsigned>(bytes[first_nibble(axis) + i] - kZero) << (4 * i);
    }
    reply.counts[axis] = static_cast<std::int16_t>(static_cast<std::uint16_t>(bits));
  }
  const auto state = static_cast<unsigned>(bytes[kStateByte] - kZero);
  reply.buttons = static_cast<std::uint8_t>(state & kButtonMask);
  reply.homed = static_cast<std::uint8_t>(state >> kHomedShift);
  return reply;
}

std::optional<Reply> ReplyStream::feed(std::span<const std::uint8_t> bytes) noexcept {
  std::optional<Reply> latest;
  for (const std::uint8_t byte : bytes) {
    if (!belongs_at(size_, byte)) {
      discarded_bytes_ += size_;
      size_ = 0;
      // The byte that breaks one packet may be the start of the next.
      if (byte != kStart) {
        ++discarded_bytes_;
        continue;
      }
    }
    packet_[size_++] = byte;
    if (size_ == kPacketBytes) {
      latest = decode_reply(packet_);
      ++replies_;
      size_ = 0;
    }
  }
  return latest;
}

}  // namespace drivers::haptic::falcon
