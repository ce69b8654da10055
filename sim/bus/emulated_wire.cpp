#include "sim/bus/emulated_wire.h"

#include <algorithm>
#include <tuple>
#include <utility>

namespace sim::bus {

using std::chrono::nanoseconds;

EmulatedWire::EmulatedWire(EmulatedBus& bus, WireOptions options)
    : bus_(bus), player_(bus, std::move(options.faults)), timed_(options.timed), start_(bus.now()) {
  player_.run_until(now());
}

void EmulatedWire::send(std::span<const std::uint8_t> frame) noexcept {
  std::array<std::uint8_t, drivers::ethercat::kMaxFrameBytes> bytes;
  const FrameFate fate = player_.begin_frame(now());
  if (frame.size() > bytes.size() || fate.request_lost) return;
  std::ranges::copy(frame, bytes.begin());
  const std::span<std::uint8_t> reply = std::span(bytes).first(frame.size());
  if (!bus_.process(reply) || fate.reply_lost) return;
  const nanoseconds due = now() + (timed_ ? bus_.round_trip(frame.size()) : nanoseconds(0)) + fate.delay;
  const std::size_t size = player_.spoil(reply);
  enqueue(reply.first(size), due);
  if (fate.twice) enqueue(reply.first(size), due);
}

void EmulatedWire::enqueue(std::span<const std::uint8_t> frame, nanoseconds due) noexcept {
  if (frame.empty()) return;
  Reply* const free = std::ranges::find(replies_, std::size_t{0}, &Reply::size);
  if (free == replies_.end()) {
    ++dropped_;
    return;
  }
  std::ranges::copy(frame, free->bytes.begin());
  free->size = frame.size();
  free->due = due;
  free->order = sent_++;
}

EmulatedWire::Reply* EmulatedWire::first() noexcept {
  Reply* found = nullptr;
  for (Reply& reply : replies_) {
    if (reply.size == 0) continue;
    if (found == nullptr || std::tie(reply.due, reply.order) < std::tie(found->due, found->order))
      found = &reply;
  }
  return found;
}

std::optional<nanoseconds> EmulatedWire::next_reply() const noexcept {
  std::optional<nanoseconds> next;
  for (const Reply& reply : replies_) {
    if (reply.size != 0) next = next ? std::min(*next, reply.due) : reply.due;
  }
  return next;
}

std::size_t EmulatedWire::receive(std::span<std::uint8_t> buffer) noexcept {
  Reply* const reply = first();
  if (reply == nullptr || reply->due > now()) return 0;
  const std::size_t size = std::min(buffer.size(), reply->size);
  std::copy_n(reply->bytes.begin(), size, buffer.begin());
  reply->size = 0;
  return size;
}

void EmulatedWire::advance(nanoseconds step) noexcept {
  const nanoseconds end = now() + step;
  for (auto change = player_.next_change(); change && *change <= end; change = player_.next_change()) {
    if (*change > now()) bus_.advance(*change - now());
    player_.run_until(now());
  }
  if (end > now()) bus_.advance(end - now());
}

}  // namespace sim::bus
