/// @file
/// When a robot's sample comes so late that its way is not to be taken for that of one period.
#pragma once
#include <chrono>

namespace youbotd {

/// After a pause of the loop, or of the bus' answers. Up to so many periods a step of fixed length is the
/// better one, as a late wake-up is no motion of the robot; it shows a tenth too much speed at most.
inline constexpr int kPeriodsTakenForOne = 3;

/// Cycle: pure. `gap`: between the stamps of two samples.
inline bool to_be_bridged(std::chrono::duration<double> gap, std::chrono::duration<double> period) noexcept {
  return gap > kPeriodsTakenForOne * period;
}

}  // namespace youbotd
