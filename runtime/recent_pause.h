/// @file
/// A pause of the loop that may be the cause of what robot or master report just after it.
#pragma once
#include <chrono>
#include <string>

namespace runtime {

/// Cycle.
class RecentPause {
 public:
  /// In a step that came so late that the cycle calls it stalled: a lost frame alone never takes as long.
  void note(std::chrono::nanoseconds now, std::chrono::nanoseconds gap) noexcept {
    if (gap < length_ && now - ended_ <= kMemory) return;
    length_ = gap;
    ended_ = now;
  }
  /// The longest pause of the last 0.2 s; 0 without one.
  std::chrono::nanoseconds before(std::chrono::nanoseconds now) const noexcept {
    return length_.count() > 0 && now - ended_ <= kMemory ? length_ : std::chrono::nanoseconds(0);
  }

 private:
  /// A drive's own watchdog takes 100 ms, and its state shows some cycles later.
  static constexpr std::chrono::milliseconds kMemory{200};
  std::chrono::nanoseconds length_{};
  std::chrono::nanoseconds ended_{};
};

/// "this program did not run for 0.300 s, then " before what that may have caused; empty without a pause.
std::string then(std::chrono::nanoseconds pause);

}  // namespace runtime
