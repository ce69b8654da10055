/// @file
/// Marks by which simulated slaves identify themselves on the wire.
///
/// The mark is in the group of their SII's general category, which no master needs; their names are those of
/// the real boards. A master treats a bus as simulated only if every slave carries the mark. No board of a
/// robot can match by accident: the group is in its EEPROM, is read again at each start, and all its
/// characters must match.
#pragma once
#include <algorithm>
#include <chrono>
#include <cstdint>
#include <span>
#include <string_view>

#include "drivers/ethercat/slave.h"

namespace drivers::ethercat {

/// A program emulates these slaves in real time, and answers late when its machine is busy.
inline constexpr std::string_view kSimulatedMark = "simulated by youbot-sim";

/// Their time advances with the frames and not with the clock. A master in virtual time must never drive a
/// robot, whose time advances by itself: a bus with a single slave without this mark is left in the state it
/// was found in.
inline constexpr std::string_view kLockStepMark = "simulated in lock-step by youbot-sim";

/// In lock-step, each frame advances simulated time by this period: the master may cycle as fast as both ends
/// can, or wait for seconds (LockStepLink).
inline constexpr std::chrono::milliseconds kLockStepPeriod{1};

/// In the user memory of the slaves, which has no meaning for their controllers: whether the simulated
/// robot's wheels are lifted (1) or on the ground (0). There is no other way to lift it.
inline constexpr std::uint16_t kLiftedAddress = 0x0F80;

/// The first slave that does not carry `mark`; null if all do.
inline const Slave* first_without(std::string_view mark, std::span<const Slave> slaves) noexcept {
  const auto found =
      std::ranges::find_if(slaves, [&](const Slave& slave) { return slave.sii.group != mark; });
  return found == slaves.end() ? nullptr : &*found;
}

}  // namespace drivers::ethercat
