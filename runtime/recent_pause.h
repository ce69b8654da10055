/// @file
/// A pause of the loop that may explain reports of the robot or the haptic device just after it.
#pragma once
#include <chrono>
#include <string>

namespace runtime {

/// Cycle.
class RecentPause {
 public:
  /// In a step that is so late that the cycle counts as stalled: a lost frame alone never takes this long.
  void note(std::chrono::nanoseconds now, std::chrono::nanoseconds gap) noexcept {
    if (gap < length_ && now - ended_ <= kMemory) return;
    length_ = gap;
    ended_ = now;
  }
  /// The longest pause of the last 0.2 s; 0 if there was none.
  std::chrono::nanoseconds before(std::chrono::nanoseconds now) const noexcept {
    return length_.count() > 0 && now - ended_ <= kMemory ? length_ : std::chrono::nanoseconds(0);
  }

 private:
  /// A drive's own watchdog takes 100 ms, and its state is visible some cycles later.
  static constexpr std::chrono::milliseconds kMemory{200};
  std::chrono::nanoseconds length_{};
  std::chrono::nanoseconds ended_{};
};

/// "this program did not run for 0.300 s, then ", a prefix for its possible consequences; empty without a
/// pause.
std::string then(std::chrono::nanoseconds pause);

}  // namespace runtime
