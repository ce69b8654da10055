/// @file
/// The wall clock of this process, which a script sets like an administrator or NTP.
#pragma once
#include <chrono>

namespace faults {

/// Shifts it from now on. Another jump replaces the previous one. The monotonic clocks are unchanged.
void jump_wall_clock(std::chrono::duration<double> by) noexcept;

}  // namespace faults
