/// @file
/// The kinds of fault, by the part they affect.
#pragma once
#include <vector>

#include "tests/faults/script.h"

namespace faults {

/// Boards that receive nothing stop within their watchdog's time, others once the daemon's bus is no longer
/// bridged; plus some periods.
inline constexpr std::chrono::milliseconds kLoss{115};

/// From 0.3 m/s at 0.5 m/s^2, with the controller's lag; an arm is lowered in 3 s, from the end of its motion
/// on.
inline constexpr std::chrono::milliseconds kStop{1500};
inline constexpr std::chrono::milliseconds kLowering{5500};

std::vector<Kind> wire_kinds();     ///< frames, cables, other masters
std::vector<Kind> board_kinds();    ///< slaves: power, state, mailbox, sensors
std::vector<Kind> machine_kinds();  ///< mechanics, and the daemon's process, clock and disk
std::vector<Kind> people_kinds();   ///< clients, and the hand with its handle

}  // namespace faults
