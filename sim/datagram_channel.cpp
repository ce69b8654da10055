#include "sim/datagram_channel.h"

#include <algorithm>
#include <utility>

namespace sim {

void DatagramChannel::send(std::span<const std::uint8_t> datagram, std::chrono::nanoseconds now) {
  // Drawn for each datagram, so that a silence does not change what happens to the others.
  const bool lost = draw() < conditions_.loss;
  const bool repeated = draw() < conditions_.repeated;
  if (silent_ || lost) return;
  deliver_later(datagram, now);
  if (repeated) deliver_later(datagram, now);
}

void DatagramChannel::deliver_later(std::span<const std::uint8_t> datagram, std::chrono::nanoseconds now) {
  const double shift = 2 * draw() - 1;
  if (waiting_.size() >= kMaxWaiting) return;
  const auto jitter = std::chrono::nanoseconds(
      static_cast<std::int64_t>(shift * static_cast<double>(conditions_.jitter.count())));
  const std::chrono::nanoseconds delay = std::max(conditions_.delay + jitter, std::chrono::nanoseconds(0));
  waiting_.push_back({now + delay, sent_++, {datagram.begin(), datagram.end()}});
  std::push_heap(waiting_.begin(), waiting_.end(), later);
}

std::size_t DatagramChannel::receive(std::span<std::uint8_t> buffer, std::chrono::nanoseconds now) {
  if (waiting_.empty() || waiting_.front().due > now) return 0;
  std::pop_heap(waiting_.begin(), waiting_.end(), later);
  const std::vector<std::uint8_t> bytes = std::move(waiting_.back().bytes);
  waiting_.pop_back();
  const std::size_t size = std::min(bytes.size(), buffer.size());
  std::copy_n(bytes.begin(), size, buffer.begin());
  return size;
}

std::chrono::nanoseconds DatagramChannel::next() const noexcept {
  return waiting_.empty() ? std::chrono::nanoseconds::max() : waiting_.front().due;
}

}  // namespace sim
