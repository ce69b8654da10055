#include "sim/bus/fault_script.h"

#include <algorithm>
#include <stdexcept>
#include <string>
#include <utility>

#include "drivers/ethercat/frame.h"
#include "sim/bus/passing_frame.h"

namespace sim::bus {
namespace {

using std::chrono::nanoseconds;

bool concerns_frames(FaultKind kind) noexcept { return kind <= FaultKind::kDamageOnCable; }

bool concerns_one_slave(FaultKind kind) noexcept {
  return kind >= FaultKind::kDamageOnCable && kind != FaultKind::kBrownOut;
}

void change_counter(std::span<std::uint8_t> frame, std::uint32_t number, std::int32_t change) noexcept {
  PassingFrame passing(frame);
  if (number >= passing.datagrams().size()) return;
  const drivers::ethercat::Datagram& datagram = passing.datagrams()[number];
  drivers::ethercat::store_le(datagram.counter,
                              static_cast<std::uint16_t>(datagram.working_counter() + change));
}

}  // namespace

FaultPlayer::FaultPlayer(EmulatedBus& bus, std::vector<FaultEvent> events) : bus_(bus) {
  std::string problems;
  for (std::size_t i = 0; i < events.size(); ++i) {
    const FaultEvent& event = events[i];
    const auto require = [&problems, i](bool holds, const std::string& problem) {
      if (!holds) problems += "; event " + std::to_string(i + 1) + ": " + problem;
    };
    require(
        !concerns_one_slave(event.kind) || event.slave < bus.size(),
        "there is no slave " + std::to_string(event.slave + 1) + ", but 1 to " + std::to_string(bus.size()));
    require(!concerns_frames(event.kind) || event.count > 0, "it spoils no frame");
    require(event.kind != FaultKind::kForeignWrite ||
                (event.count > 0 && event.count <= drivers::ethercat::kMaxDatagramBytes / 2),
            "it writes nothing, or more than fits a frame");
    require(event.kind != FaultKind::kForeignWrite || event.offset <= 0xFFFF, "there is no such register");
    require(event.at.count() >= 0 && event.duration.count() >= 0 && event.delay.count() >= 0,
            "a time is negative");
    require(event.kind != FaultKind::kDelay || event.delay.count() > 0, "there is no delay");
    entries_.push_back({.event = event});
  }
  if (!problems.empty()) throw std::invalid_argument("fault script" + problems);
}

FrameFate FaultPlayer::begin_frame(nanoseconds now) noexcept {
  const std::uint64_t number = frames_++;
  FrameFate fate;
  for (Entry& entry : entries_) {
    const FaultEvent& event = entry.event;
    if (entry.phase == Phase::kWaiting && (event.at_frame ? number >= *event.at_frame : now >= event.at)) {
      begin(entry, now);
    }
    entry.on_this_frame = concerns_frames(event.kind) && entry.phase == Phase::kActive;
    if (!entry.on_this_frame) continue;
    if (--entry.frames_left == 0) entry.phase = Phase::kOver;
    switch (event.kind) {
      case FaultKind::kDropRequest: fate.request_lost = true; break;
      case FaultKind::kDropReply: fate.reply_lost = true; break;
      case FaultKind::kDuplicate: fate.twice = true; break;
      case FaultKind::kDelay: fate.delay += event.delay; break;
      case FaultKind::kDamageOnCable: bus_.damage(event.slave, 1); break;
      default: break;
    }
  }
  return fate;
}

std::size_t FaultPlayer::spoil(std::span<std::uint8_t> reply) noexcept {
  std::size_t size = reply.size();
  for (const Entry& entry : entries_) {
    if (!entry.on_this_frame) continue;
    const FaultEvent& event = entry.event;
    switch (event.kind) {
      case FaultKind::kTruncate: size = std::min<std::size_t>(size, event.offset); break;
      case FaultKind::kCorrupt:
        if (event.offset < size) reply[event.offset] ^= event.mask;
        break;
      case FaultKind::kWrongCounter:
        change_counter(reply.first(size), event.datagram, event.counter_change);
        break;
      default: break;
    }
  }
  return size;
}

void FaultPlayer::run_until(nanoseconds now) noexcept {
  for (Entry& entry : entries_) {
    if (concerns_frames(entry.event.kind)) continue;
    if (entry.phase == Phase::kWaiting && !entry.event.at_frame && now >= entry.event.at) begin(entry, now);
    if (entry.phase == Phase::kActive && entry.event.duration.count() > 0 && now >= entry.end) {
      entry.phase = Phase::kOver;
      apply_to_bus(entry.event, false);
    }
  }
}

std::optional<nanoseconds> FaultPlayer::next_change() const noexcept {
  std::optional<nanoseconds> next;
  const auto consider = [&next](nanoseconds time) { next = next ? std::min(*next, time) : time; };
  for (const Entry& entry : entries_) {
    if (concerns_frames(entry.event.kind)) continue;
    if (entry.phase == Phase::kWaiting && !entry.event.at_frame) consider(entry.event.at);
    if (entry.phase == Phase::kActive && entry.event.duration.count() > 0) consider(entry.end);
  }
  return next;
}

bool FaultPlayer::finished() const noexcept {
  return std::ranges::all_of(entries_, [](const Entry& entry) { return entry.phase == Phase::kOver; });
}

void FaultPlayer::begin(Entry& entry, nanoseconds now) noexcept {
  entry.phase = Phase::kActive;
  entry.frames_left = entry.event.count;
  entry.end = now + entry.event.duration;
  if (entry.event.kind == FaultKind::kForeignWrite) entry.phase = Phase::kOver;
  if (!concerns_frames(entry.event.kind)) apply_to_bus(entry.event, true);
}

void FaultPlayer::apply_to_bus(const FaultEvent& event, bool present) noexcept {
  switch (event.kind) {
    case FaultKind::kSlaveOff: bus_.set_power(event.slave, !present); break;
    case FaultKind::kCableOut: bus_.set_cable(event.slave, !present); break;
    case FaultKind::kBrownOut:
      for (std::size_t i = 0; i < bus_.size(); ++i) bus_.set_power(i, !present);
      break;
    case FaultKind::kMailboxHung: bus_.slave(event.slave).hang_mailbox(present); break;
    case FaultKind::kBoardFault: bus_.slave(event.slave).set_fault(event.board_fault, present); break;
    case FaultKind::kForeignWrite:
      bus_.write_as_another_master(event.slave, static_cast<std::uint16_t>(event.offset), event.value,
                                   event.count);
      break;
    default: break;
  }
}

}  // namespace sim::bus
