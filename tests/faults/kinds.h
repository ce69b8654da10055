/// @file
/// The kinds of fault, by what they strike.
#pragma once
#include <vector>

#include "tests/faults/script.h"

namespace faults {

/// Boards that hear nothing any more stop within their watchdog's time, those that do once the daemon's bus
/// is no longer bridged; and some periods.
inline constexpr std::chrono::milliseconds kLoss{115};

std::vector<Kind> wire_kinds();     ///< frames, cables, other masters
std::vector<Kind> board_kinds();    ///< slaves: power, state, mailbox, sensors
std::vector<Kind> machine_kinds();  ///< mechanics, and the daemon's process, clock and disk
std::vector<Kind> people_kinds();   ///< clients, and the hand with its pen

}  // namespace faults
