/// @file
/// The wall clock of this process, which a script sets as an administrator or NTP does.
#pragma once
#include <chrono>

namespace faults {

/// From now on it is so much later than it was, or earlier. Another jump takes the place of the one before.
/// The monotonic clocks go on.
void jump_wall_clock(std::chrono::duration<double> by) noexcept;

}  // namespace faults
