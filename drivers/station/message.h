/// @file
/// What two stations of a teleoperation send each other, as bytes: fixed order, little-endian, integers only.
///
/// Both messages begin with a LinkState, then the number of states, then the states, newest first: the state
/// of this message and repetitions of the states before it, against loss.
#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

#include "drivers/haptic/haptic_fault.h"

namespace drivers::station {

/// States that a message repeats at most.
inline constexpr int kMaxRepeated = 8;

/// Of the sender.
struct LinkState {
  std::int64_t sent_ns = 0;         ///< in the sender's clock
  std::int64_t echo_ns = 0;         ///< `sent_ns` of the newest message that it received; 0: none
  std::uint32_t echo_held_us = 0;   ///< since it received that one
  std::uint16_t lost_permille = 0;  ///< of the messages sent to it
  std::int64_t energy_in_nJ = 0;    ///< that entered the link at its port since the start of the session
  bool enable = false;              ///< robot: a force is wanted. Operator: the robot's messages arrive
  bool released = false;            ///< operator: no hand holds the handle
  haptic::HapticFault fault = haptic::HapticFault::kNone;  ///< operator: of the haptic device
  std::uint32_t detail = 0;                                ///< likewise
  bool operator==(const LinkState&) const = default;
};

/// What the operator's haptic device measured.
struct HandleState {
  std::uint32_t age_us = 0;  ///< of the measurement, when its message was first sent
  std::array<std::int32_t, 3> position_nm{};
  std::array<std::int32_t, 4> rotation_q30{1 << 30, 0, 0, 0};  ///< unit quaternion w, x, y, z times 2^30
  std::uint32_t buttons = 0;
  std::array<std::int32_t, 3> force_uN{};  ///< that acted on the hand until then
  bool operator==(const HandleState&) const = default;
};

/// The force that the robot's station wants on the hand.
struct ForceState {
  std::array<std::int32_t, 3> force_uN{};
  bool operator==(const ForceState&) const = default;
};

template <typename State>
struct Message {
  LinkState link;
  std::uint8_t count = 0;  ///< of the states, 1 to kMaxRepeated + 1
  std::array<State, kMaxRepeated + 1> states{};
  bool operator==(const Message&) const = default;
};
using HandleMessage = Message<HandleState>;
using ForceMessage = Message<ForceState>;

/// A message with all repetitions, and room for the envelope of a session.
inline constexpr std::size_t kMaxMessageBytes = 512;

/// Cycle. Bytes written; 0 if `bytes` is too small.
std::size_t encode(const HandleMessage& message, std::span<std::uint8_t> bytes) noexcept;
std::size_t encode(const ForceMessage& message, std::span<std::uint8_t> bytes) noexcept;
/// Cycle. False, with `message` unspecified, unless the bytes are exactly one message that encode() can make,
/// its rotations are unit quaternions within 1 %, its times are 0 to 2^62 ns and its energy is not negative.
bool decode(std::span<const std::uint8_t> bytes, HandleMessage& message) noexcept;
bool decode(std::span<const std::uint8_t> bytes, ForceMessage& message) noexcept;

}  // namespace drivers::station
