#include "sim/bus/emulated_wire.h"

#include <algorithm>
#include <utility>

namespace sim::bus {

using std::chrono::nanoseconds;

EmulatedWire::EmulatedWire(EmulatedBus& bus, WireOptions options)
    : bus_(bus), player_(bus, std::move(options.faults)), timed_(options.timed), start_(bus.now()) {
  for (std::size_t slot = 0; slot < replies_.size(); ++slot) replies_[slot].slot = slot;
  player_.run_until(now());
}

void EmulatedWire::send(std::span<const std::uint8_t> frame) noexcept {
  std::array<std::uint8_t, drivers::ethercat::kMaxFrameBytes> bytes;
  const FrameFate fate = player_.begin_frame(now());
  if (frame.size() > bytes.size() || fate.request_lost) return;
  // As one copy: g++ 12 compiles std::ranges::copy to a loop over bytes.
  std::copy(frame.begin(), frame.end(), bytes.begin());
  const std::span<std::uint8_t> reply = std::span(bytes).first(frame.size());
  if (!bus_.process(reply) || fate.reply_lost) return;
  const nanoseconds due = now() + (timed_ ? bus_.round_trip(frame.size()) : nanoseconds(0)) + fate.delay;
  const std::size_t size = player_.spoil(reply);
  enqueue(reply.first(size), due);
  if (fate.twice) enqueue(reply.first(size), due);
}

void EmulatedWire::enqueue(std::span<const std::uint8_t> frame, nanoseconds due) noexcept {
  if (frame.empty()) return;
  if (under_way_ == replies_.size()) {
    ++dropped_;
    return;
  }
  // After those due at the same time.
  const auto end = replies_.begin() + static_cast<std::ptrdiff_t>(under_way_++);
  const auto place = std::upper_bound(replies_.begin(), end, due,
                                      [](nanoseconds time, const Reply& reply) { return time < reply.due; });
  std::rotate(place, end, end + 1);  // the slot of a finished reply
  place->due = due;
  place->size = frame.size();
  std::copy(frame.begin(), frame.end(), slots_[place->slot].begin());
}

std::optional<nanoseconds> EmulatedWire::next_reply() const noexcept {
  return under_way_ > 0 ? std::optional(replies_.front().due) : std::nullopt;
}

std::size_t EmulatedWire::receive(std::span<std::uint8_t> buffer) noexcept {
  if (under_way_ == 0 || replies_.front().due > now()) return 0;
  const Reply& reply = replies_.front();
  const std::size_t size = std::min(buffer.size(), reply.size);
  std::copy_n(slots_[reply.slot].begin(), size, buffer.begin());
  std::rotate(replies_.begin(), replies_.begin() + 1,
              replies_.begin() + static_cast<std::ptrdiff_t>(under_way_--));
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
