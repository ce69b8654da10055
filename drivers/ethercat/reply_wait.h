/// @file
/// How to wait for the reply to a frame: sleep until shortly before its usual time, then poll briefly.
#pragma once
#include <algorithm>
#include <chrono>

namespace drivers::ethercat {

/// A blocked thread gets the reply only after the kernel has woken it; a polling thread gets it at once but
/// occupies a core. Replies on one bus take nearly the same time each cycle. So the thread sleeps until just
/// before the usual arrival of the reply, and polls. If no reply arrives within kMaxPolling, the thread
/// blocks. After kMaxMisses of these in a row it only blocks for the next frames: on a shared core, polling
/// may delay the reply. Pure logic without a clock. Cycle: all of it.
class ReplyWait {
 public:
  /// In one receive().
  static constexpr std::chrono::nanoseconds kMaxPolling{50'000};

  struct Plan {
    bool polls = false;
    /// Sleep until this time after send(), unless a frame arrives earlier; then poll.
    std::chrono::nanoseconds asleep{};
  };
  /// For the last frame sent.
  Plan plan() const noexcept {
    if (usual_.count() == 0 || pause_ > 0) return {};
    const std::chrono::nanoseconds asleep = usual_ - waking_;
    return {.polls = true, .asleep = asleep < kShortestSleep ? std::chrono::nanoseconds{} : asleep};
  }

  /// The reply arrived this long after send(), whenever it was read.
  void replied(std::chrono::nanoseconds after) noexcept {
    if (pause_ > 0) --pause_;
    after = std::max(after, std::chrono::nanoseconds{1});
    if (usual_.count() == 0)
      usual_ = after;
    else if (after < usual_)  // falls fast and rises slowly: to wake too late costs more than to poll longer
      usual_ -= (usual_ - after) / 4;
    else
      usual_ += std::min(after - usual_, kOutlier) / 16;
  }
  /// No reply arrived before the next frame was sent. The bus may have changed: polling needs a new estimate.
  void lost() noexcept { usual_ = {}; }

  /// The thread ran this long after a timer or a frame woke it.
  void woke(std::chrono::nanoseconds late) noexcept {
    waking_ += std::min(std::max(late, std::chrono::nanoseconds{}) - waking_, kOutlier) / 16;
  }

  /// Whether a poll requested by plan() found a frame.
  void polled(bool found) noexcept {
    if (found) {
      misses_ = 0;
      next_pause_ = kShortestPause;
      return;
    }
    if (++misses_ < kMaxMisses) return;
    pause_ = next_pause_;
    next_pause_ = std::min(2 * next_pause_, kMaxPause);
    misses_ = kMaxMisses - 1;  // one more miss after the pause starts the next one
  }

 private:
  /// A shorter sleep costs more processor time, for two context switches, than it saves.
  static constexpr std::chrono::nanoseconds kShortestSleep{10'000};
  /// A larger difference counts as this much: a preempted thread says nothing about the next cycle.
  static constexpr std::chrono::nanoseconds kOutlier{32'000};
  static constexpr int kMaxMisses = 3;
  static constexpr int kShortestPause = 16;  // frames
  static constexpr int kMaxPause = 1024;

  std::chrono::nanoseconds usual_{};  // zero: unknown
  std::chrono::nanoseconds waking_{10'000};
  int misses_ = 0;  // in a row
  int pause_ = 0;   // frames without polling from now on
  int next_pause_ = kShortestPause;
};

}  // namespace drivers::ethercat
