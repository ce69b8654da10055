/// @file
/// How simulated slaves say on the wire that they are simulated.
///
/// They say so in the group of their SII's general category, which no master needs: their names are the real
/// boards'. A master treats a bus as simulated only if every slave on it says so. No board of a robot can by
/// accident: the group lies in its EEPROM, is read again at each start, and has all these characters to
/// match.
#pragma once
#include <algorithm>
#include <chrono>
#include <cstdint>
#include <span>
#include <string_view>

#include "drivers/ethercat/slave.h"

namespace drivers::ethercat {

/// A program emulates these slaves by the clock, and answers late when its machine is busy.
inline constexpr std::string_view kSimulatedMark = "simulated by youbot-sim";

/// Their time goes with the frames and not with the clock. A master in virtual time must never meet a robot,
/// whose time goes on by itself: a bus on which a single slave does not say this is left in the state it was
/// found in.
inline constexpr std::string_view kLockStepMark = "simulated in lock-step by youbot-sim";

/// A simulation in lock-step lets this time pass with each frame and none without: its master may cycle as
/// fast as both ends can, or wait for seconds (LockStepLink).
inline constexpr std::chrono::milliseconds kLockStepPeriod{1};

/// In the user memory of its slaves, which means nothing to their controllers: whether the simulated robot's
/// wheels are off the ground (1) or on it (0). Nothing else could lift it.
inline constexpr std::uint16_t kLiftedAddress = 0x0F80;

/// The first slave that does not carry `mark`; null when all do.
inline const Slave* first_without(std::string_view mark, std::span<const Slave> slaves) noexcept {
  const auto found =
      std::ranges::find_if(slaves, [&](const Slave& slave) { return slave.sii.group != mark; });
  return found == slaves.end() ? nullptr : &*found;
}

}  // namespace drivers::ethercat
