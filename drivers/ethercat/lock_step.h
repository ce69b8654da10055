/// @file
/// How simulated slaves say on the wire that their time goes with the frames and not with the clock.
#pragma once
#include <chrono>
#include <cstdint>
#include <string_view>

namespace drivers::ethercat {

/// A simulation in lock-step lets this time pass with each frame and none without: its master may cycle as
/// fast as both ends can, or wait for seconds. One that does not answer for so long is gone.
inline constexpr std::chrono::milliseconds kLockStepPeriod{1};

/// Such a master must never meet a robot, whose time goes on by itself. So each slave of such a simulation
/// says what it is at the end of its name (SII, general category), and a bus on which a single one does not
/// is left in the state it was found in. No board of a robot can say so by accident: the name lies in its
/// EEPROM, read anew at each start, and has 23 characters to match.
inline constexpr std::string_view kLockStepMark = " simulated in lock-step";

/// In the user memory of its slaves, which means nothing to their controllers: whether the simulated robot's
/// wheels are off the ground (1) or on it (0). Nobody else could lift it.
inline constexpr std::uint16_t kLiftedAddress = 0x0F80;

}  // namespace drivers::ethercat
