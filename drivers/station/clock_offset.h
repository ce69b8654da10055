/// @file
/// Round trip and difference of two clocks, from the four time stamps of an exchange of messages (NTP: RFC
/// 5905, section 8). Of the exchanges of the last seconds the one with the shortest round trip counts: it
/// waited least, so its two ways are the most equal.
#pragma once
#include <array>
#include <chrono>
#include <cstddef>

namespace drivers::station {

/// One thread. Cycle: everything.
class ClockOffset {
 public:
  using Time = std::chrono::nanoseconds;

  /// `sent`: when the message that the other side answers was sent. `held`: from its receipt there to the
  /// answer. `answered`: when the answer was sent, in the other clock. `received`: when it arrived here.
  void update(Time sent, Time held, Time answered, Time received) noexcept {
    const Time round_trip = received - sent - held;
    if (round_trip < Time(0)) return;  // not of one exchange
    mean_round_trip_ = known_ ? mean_round_trip_ + (round_trip - mean_round_trip_) / 64 : round_trip;
    if (!known_ || received - bucket_begin_ >= kBucket) {
      known_ = true;
      bucket_begin_ = received;
      newest_ = (newest_ + 1) % buckets_.size();
      buckets_[newest_] = {};
    }
    Exchange& bucket = buckets_[newest_];
    if (round_trip < bucket.round_trip) bucket = {round_trip, received - round_trip / 2 - answered};
  }

  bool known() const noexcept { return known_; }
  /// This clock minus the other one; its error is at most half the shortest round trip.
  Time offset() const noexcept { return shortest().offset; }
  Time shortest_round_trip() const noexcept { return known_ ? shortest().round_trip : Time(0); }
  /// Running mean of some 64 messages.
  Time mean_round_trip() const noexcept { return mean_round_trip_; }

 private:
  struct Exchange {
    Time round_trip = Time::max();
    Time offset{};
  };
  static constexpr std::chrono::seconds kBucket{1};

  const Exchange& shortest() const noexcept {
    std::size_t best = newest_;
    for (std::size_t i = 0; i < buckets_.size(); ++i)
      if (buckets_[i].round_trip < buckets_[best].round_trip) best = i;
    return buckets_[best];
  }

  std::array<Exchange, 8> buckets_{};
  std::size_t newest_ = 0;
  bool known_ = false;
  Time bucket_begin_{};
  Time mean_round_trip_{};
};

}  // namespace drivers::station
