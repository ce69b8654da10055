/// @file
/// Whether a request of a page, or a command of ROS 2, may have waited in the network.
#pragma once
#include <chrono>
#include <optional>

namespace youbotd {

/// A page is heard more often than each kLongSilence. After a longer silence the network may deliver at once
/// what it held back, so requests are stale for as long.
class Freshness {
 public:
  using Time = std::chrono::steady_clock::time_point;
  static constexpr std::chrono::milliseconds kLongSilence{500};

  /// For a peer that is heard for the first time, and may have been silent until now.
  static Freshness after_silence(Time now) {
    Freshness freshness;
    freshness.fresh_from_ = now + kLongSilence;
    return freshness;
  }

  /// For each message, with the time of its arrival: whether it is fresh.
  bool hear(Time now) {
    if (heard_ && now - *heard_ > kLongSilence) fresh_from_ = now + kLongSilence;
    heard_ = now;
    return now >= fresh_from_;
  }

 private:
  std::optional<Time> heard_;
  Time fresh_from_{};
};

}  // namespace youbotd
