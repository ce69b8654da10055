#include "drivers/ethercat/transceiver.h"

#include <algorithm>

namespace drivers::ethercat {

using std::chrono::nanoseconds;

FrameWriter& Transceiver::begin() noexcept {
  writer_.clear();
  ++index_;
  given_up_.reset(index_);
  received_size_ = 0;
  return writer_;
}

bool Transceiver::send() noexcept {
  const std::span<const std::uint8_t> frame = writer_.bytes();
  std::copy(frame.begin(), frame.end(), sent_.begin());
  sent_size_ = frame.size();
  if (tap_ != nullptr) tap_->frame(Direction::kSent, frame);
  ++counters_.sent;
  sent_at_ = link_.now();
  if (link_.send(frame)) {
    counters_.link_error = 0;
    return true;
  }
  ++counters_.not_sent;
  counters_.link_error = link_.last_error();
  return false;
}

bool Transceiver::receive(nanoseconds timeout) noexcept {
  nanoseconds left = timeout;
  for (int strangers = 0; strangers < kMaxStrangers; ++strangers) {
    const std::size_t size = link_.receive(received_, left);
    const nanoseconds passed = link_.now() - sent_at_;
    left = std::max(timeout - passed, nanoseconds{0});
    if (size == 0) break;
    const std::span<std::uint8_t> bytes(received_.data(), size);
    if (tap_ != nullptr) tap_->frame(Direction::kReceived, bytes);
    if (examine(bytes) == Match::kAnswer) {
      received_size_ = size;
      round_trip_ = passed;
      answer_age_ = std::min(link_.frame_age(), passed);
      ++counters_.received;
      return true;
    }
  }
  ++counters_.lost;
  given_up_.set(index_);
  return false;
}

Transceiver::Match Transceiver::examine(std::span<std::uint8_t> frame) noexcept {
  FrameReader reader;
  if (reader.parse(frame) != FrameError::kNone) {
    ++counters_.malformed;
    return Match::kOther;
  }
  if (is_foreign(frame)) return Match::kOther;
  FrameReader expected;
  if (expected.parse(std::span(sent_).first(sent_size_)) != FrameError::kNone) return Match::kOther;
  Datagram found;
  Datagram wanted;
  (void)reader.next(found);
  if (found.index != index_) {
    ++(given_up_.test(found.index) ? counters_.late : counters_.duplicate);
    given_up_.reset(found.index);
    return Match::kOther;
  }
  // Slaves change addresses and data, never commands or lengths.
  FrameReader all;
  (void)all.parse(frame);
  for (;;) {
    const bool more_found = all.next(found);
    const bool more_wanted = expected.next(wanted);
    if (!more_found && !more_wanted) return Match::kAnswer;
    if (more_found != more_wanted || found.command != wanted.command || found.index != wanted.index ||
        found.data.size() != wanted.data.size()) {
      ++counters_.malformed;
      return Match::kOther;
    }
  }
}

bool Transceiver::is_foreign(std::span<const std::uint8_t> frame) noexcept {
  const MacAddress& own = writer_.source();
  const auto bytes = frame.subspan<kSourceMacOffset, std::tuple_size_v<MacAddress>>();
  const auto first = static_cast<std::uint8_t>(bytes[0] & ~kReturnedBit);
  if (first == own[0] && std::equal(bytes.begin() + 1, bytes.end(), own.begin() + 1)) return false;
  MacAddress source;
  std::copy(bytes.begin(), bytes.end(), source.begin());
  source[0] = first;
  ++counters_.foreign;
  other_master_.note_frame(source, link_.now());
  return true;
}

FrameReader Transceiver::answer() noexcept {
  FrameReader reader;
  (void)reader.parse(std::span(received_).first(received_size_));
  return reader;
}

}  // namespace drivers::ethercat
