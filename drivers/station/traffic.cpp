#include "drivers/station/traffic.h"

#include <algorithm>

namespace drivers::station {

using std::chrono::microseconds;
using std::chrono::nanoseconds;

template <typename Sent, typename Received>
void Traffic<Sent, Received>::begin(const Session& session, Time now) noexcept {
  session_ = session;
  clocks_ = {};
  newest_ = {};
  newest_sequence_ = 0;
  new_states_ = 0;
  heard_at_ = now;
  answered_ns_ = 0;
  sent_ = {};
  ++report_.sessions;
}

template <typename Sent, typename Received>
bool Traffic<Sent, Received>::take(std::span<const std::uint8_t> datagram, Time now) noexcept {
  Session::Opened opened;
  if (session_) opened = session_->open(datagram, plain_);
  if (opened.verdict == Session::Verdict::kLate) ++report_.late;
  Message<Received> message;
  const bool newest = opened.verdict == Session::Verdict::kNewest &&
                      decode(std::span(plain_).first(opened.bytes), message) &&
                      message.link.echo_ns <= now.count();
  if (!newest) {
    if (opened.verdict != Session::Verdict::kLate) ++report_.refused;
    return false;
  }
  const LinkState& link = message.link;
  answered_ns_ = link.sent_ns;
  answered_at_ = now;
  if (link.echo_ns == 0) return false;  // the first ones of a session, of unknown age
  const nanoseconds echo(link.echo_ns);
  const microseconds held(link.echo_held_us);
  if (now - echo - held > kMaxAge) {
    ++report_.late;
    return false;
  }
  const std::uint64_t missed = opened.sequence - newest_sequence_ - 1;
  const auto repeated = static_cast<std::uint64_t>(message.count - 1);
  // The messages before the first one were never sent, or are not wanted.
  const std::uint64_t recovered = newest_sequence_ > 0 ? std::min(missed, repeated) : 0;
  report_.recovered += recovered;
  new_states_ = static_cast<int>(recovered) + 1;
  ++report_.newest;
  newest_sequence_ = opened.sequence;
  newest_ = message;
  heard_at_ = now;
  clocks_.update(echo, held, nanoseconds(link.sent_ns), now);
  return true;
}

template <typename Sent, typename Received>
std::span<const std::uint8_t> Traffic<Sent, Received>::make(LinkState link, const Sent& state,
                                                            Time now) noexcept {
  if (!session_) return {};
  report_.repeated = repetitions_for(newest_.link.lost_permille, most_repeated_);
  std::shift_right(sent_.states.begin(), sent_.states.end(), 1);
  sent_.states[0] = state;
  const auto available = static_cast<int>(std::min<std::uint64_t>(session_->sequence(), kMaxRepeated));
  sent_.count = static_cast<std::uint8_t>(1 + std::min(report_.repeated, available));
  link.sent_ns = now.count();
  link.echo_ns = answered_ns_;
  link.echo_held_us = static_cast<std::uint32_t>(std::clamp<std::int64_t>(
      std::chrono::duration_cast<microseconds>(now - answered_at_).count(), 0, UINT32_MAX));
  link.lost_permille = static_cast<std::uint16_t>(session_->received().lost_permille());
  sent_.link = link;
  const std::size_t plain = encode(sent_, plain_);
  return std::span(sealed_).first(session_->seal(std::span(plain_).first(plain), sealed_));
}

template <typename Sent, typename Received>
LinkReport Traffic<Sent, Received>::report(Time now, Time allowed_silence) const noexcept {
  LinkReport report = report_;
  report.connected = heard() && silence(now) <= allowed_silence;
  if (!heard()) return report;
  report.silence = silence(now);
  report.age = now - (nanoseconds(newest_.link.sent_ns) + clocks_.offset());
  if (!clocks_.known()) report.age = report.silence;
  report.round_trip = clocks_.mean_round_trip();
  report.shortest_round_trip = clocks_.shortest_round_trip();
  report.clock_offset = clocks_.offset();
  report.lost_permille = session_->received().lost_permille();
  report.lost_there_permille = newest_.link.lost_permille;
  return report;
}

template class Traffic<HandleState, ForceState>;
template class Traffic<ForceState, HandleState>;

}  // namespace drivers::station
