/// @file
/// The messages of one session: sequence, repetition, measurement of delay and loss.
#pragma once
#include <array>
#include <chrono>
#include <cstdint>
#include <optional>
#include <span>

#include "drivers/station/clock_offset.h"
#include "drivers/station/message.h"
#include "drivers/station/session.h"

namespace drivers::station {

/// What one side knows of the link.
struct LinkReport {
  bool connected = false;              ///< the other side has been heard within the allowed silence
  std::chrono::nanoseconds silence{};  ///< since a newer message arrived
  std::chrono::nanoseconds age{};      ///< of the newest message, way included, by the estimated clock offset
  std::chrono::nanoseconds round_trip{};           ///< running mean
  std::chrono::nanoseconds shortest_round_trip{};  ///< of the last seconds
  std::chrono::nanoseconds clock_offset{};         ///< this clock minus the other one
  unsigned lost_permille = 0;                      ///< of the messages to this side
  unsigned lost_there_permille = 0;                ///< of the messages to the other side
  int repeated = 0;                                ///< states that each message to the other side repeats
  std::uint64_t sessions = 0;
  std::uint64_t newest = 0;     ///< messages that were newer than all before
  std::uint64_t recovered = 0;  ///< states that were lost, and arrived as repetitions
  /// Messages that a newer one had overtaken, or that may be older than kMaxAge: they move nothing.
  std::uint64_t late = 0;
  std::uint64_t refused = 0;  ///< replayed, forged, malformed, or of another session or program
};

/// A message that may be older moves nothing, however genuine it is. Its sender answers a message of this
/// side, so that it cannot be older than their round trip, which this side's clock alone measures: the link
/// needs a round trip below this. The difference of the clocks would not do, as its error is up to half the
/// round trip.
inline constexpr std::chrono::milliseconds kMaxAge{500};

/// `Sent` and `Received`: HandleState and ForceState, or the reverse. One thread. Cycle: everything.
template <typename Sent, typename Received>
class Traffic {
 public:
  using Time = std::chrono::nanoseconds;

  explicit Traffic(int most_repeated) : most_repeated_(most_repeated) {}

  void begin(const Session& session, Time now) noexcept;
  void end() noexcept { session_.reset(); }
  bool in_session() const noexcept { return session_.has_value(); }

  /// True if it is the newest message of the session, and answers one of this side within kMaxAge. Any other
  /// datagram changes nothing but the counters and what make() answers.
  bool take(std::span<const std::uint8_t> datagram, Time now) noexcept;
  /// The next message, sealed, with the fields of `link` that are not of time or loss. Empty without a
  /// session.
  std::span<const std::uint8_t> make(LinkState link, const Sent& state, Time now) noexcept;
  void count_refused() noexcept { ++report_.refused; }

  /// In this session.
  bool heard() const noexcept { return in_session() && newest_sequence_ > 0; }
  /// Since the last newer message, or the start of the session.
  Time silence(Time now) const noexcept { return now - heard_at_; }
  const Message<Received>& newest() const noexcept { return newest_; }
  /// How many of its states, the first ones, were not in the newest message before it.
  int new_states() const noexcept { return new_states_; }
  LinkReport report(Time now, Time allowed_silence) const noexcept;

 private:
  int most_repeated_;
  std::optional<Session> session_;
  ClockOffset clocks_;
  LinkReport report_;  // the counters

  Message<Received> newest_;
  std::uint64_t newest_sequence_ = 0;
  int new_states_ = 0;
  Time heard_at_{};
  std::int64_t answered_ns_ = 0;  // when the newest genuine message was sent, however late; 0: none
  Time answered_at_{};            // and when it arrived

  Message<Sent> sent_;
  std::array<std::uint8_t, kMaxMessageBytes> plain_{};
  std::array<std::uint8_t, kMaxMessageBytes> sealed_{};
};

extern template class Traffic<HandleState, ForceState>;
extern template class Traffic<ForceState, HandleState>;

}  // namespace drivers::station
