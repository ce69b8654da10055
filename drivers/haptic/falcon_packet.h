/// @file
/// The Novint Falcon's packets while its firmware runs: 16 bytes each way, one reply to each command.
/// Source: libnifalcon, FalconFirmwareNovintSDK.cpp.
///
///   byte    command            reply
///   0       '<'                '<'
///   1-4     motor 0            encoder 0        16 bit two's complement as four nibbles, each + 'A', the
///   5-8     motor 1            encoder 1        least significant one first
///   9-12    motor 2            encoder 2
///   13      homing, LEDs       buttons, homed   seven bits, + 'A'
///   14      0                  not used         + 'A'
///   15      '>'                '>'
///
/// There is no check sum, but neither mark can stand among the 14 bytes between them: a lost or an added
/// byte is always noticed and costs the packets that it touched. Everything here is cycle-safe.
#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>

namespace drivers::haptic::falcon {

inline constexpr std::size_t kAxes = 3;
inline constexpr std::size_t kPacketBytes = 16;
/// The motor takes no more; a 16 bit value that wrapped would turn the force around.
inline constexpr std::int32_t kMotorLimit = 4096;

using Packet = std::array<std::uint8_t, kPacketBytes>;

struct Leds {
  bool green = false;
  bool blue = false;
  bool red = false;
  friend bool operator==(const Leds&, const Leds&) = default;
};

struct Command {
  std::array<std::int32_t, kAxes> motors{};  ///< see within_motor_limit()
  Leds leds;
  bool homing =
      true;  ///< to be set in every packet: one without it makes the device forget that it was homed
};

enum class Button : std::uint8_t { kPlus = 0, kForward = 1, kCentre = 2, kMinus = 3 };  ///< bit numbers

struct Reply {
  std::array<std::int16_t, kAxes> counts{};  ///< of no meaning before the axis is homed; see angles_rad()
  std::uint8_t buttons = 0;                  ///< bits: Button
  std::uint8_t homed = 0;                    ///< bit of each axis
  bool all_homed() const noexcept { return homed == 0b111; }
  bool pressed(Button button) const noexcept { return (buttons >> static_cast<unsigned>(button) & 1U) != 0; }
  friend bool operator==(const Reply&, const Reply&) = default;
};

/// Beyond ±kMotorLimit all three are made smaller by the same factor, towards zero, so that the force keeps
/// its direction.
std::array<std::int32_t, kAxes> within_motor_limit(const std::array<std::int32_t, kAxes>& motors) noexcept;

/// With the motors within their limit.
Packet encode(const Command& command) noexcept;
/// Nothing when it is not 16 bytes of this form.
std::optional<Reply> decode_reply(std::span<const std::uint8_t> bytes) noexcept;

/// Finds replies in bytes that come in pieces of any size, among bytes that belong to none.
class ReplyStream {
 public:
  /// The latest reply that is complete with these bytes.
  std::optional<Reply> feed(std::span<const std::uint8_t> bytes) noexcept;
  /// Replies that are complete, since construction.
  std::uint64_t replies() const noexcept { return replies_; }
  /// Bytes that turned out to be part of no reply, since construction.
  std::uint64_t discarded_bytes() const noexcept { return discarded_bytes_; }

 private:
  Packet packet_{};
  std::size_t size_ = 0;  // of packet_; 0: waiting for a start
  std::uint64_t replies_ = 0;
  std::uint64_t discarded_bytes_ = 0;
};

}  // namespace drivers::haptic::falcon
