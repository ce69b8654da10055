#include "drivers/ethercat/other_master.h"

#include <algorithm>
#include <array>
#include <cstdio>

#include "drivers/ethercat/register_text.h"
#include "drivers/ethercat/registers.h"

namespace drivers::ethercat {
namespace {

using std::chrono::nanoseconds;

constexpr std::uint64_t kFewestFrames = 3;
/// Frames left on the wire by a program that has ended arrive in one burst.
constexpr std::chrono::milliseconds kShortestStay{10};
constexpr std::chrono::seconds kMemory{1};

}  // namespace

bool OtherMaster::Sender::recent(nanoseconds now) const noexcept {
  return weight > 0 && now - last <= kMemory;
}

bool OtherMaster::Sender::keeps_coming() const noexcept {
  return weight >= kFewestFrames && last - first >= kShortestStay;
}

// Counts the frequent sources of a stream in fixed memory (Misra and Gries, 1982): a source with more than a
// fifth of the foreign frames keeps a place, whatever the order, and damaged addresses cancel each other.
void OtherMaster::note_frame(MacAddress source, nanoseconds now) noexcept {
  source[0] &= static_cast<std::uint8_t>(~kReturnedBit);
  Sender* free = nullptr;
  for (Sender& sender : senders_) {
    if (!sender.recent(now)) {
      free = &sender;
    } else if (sender.source == source) {
      ++sender.frames;
      ++sender.weight;
      sender.last = now;
      return;
    }
  }
  if (free != nullptr)
    *free = {.source = source, .frames = 1, .weight = 1, .first = now, .last = now};
  else
    for (Sender& sender : senders_) --sender.weight;
}

void OtherMaster::note_order(Order order, nanoseconds now) noexcept {
  ordered_ = true;
  order_ = order;
  last_order_ = now;
}

bool OtherMaster::present(nanoseconds now) const noexcept {
  const bool sends = std::ranges::any_of(
      senders_, [now](const Sender& sender) { return sender.recent(now) && sender.keeps_coming(); });
  return sends || (ordered_ && now - last_order_ <= kMemory);
}

const OtherMaster::Sender* OtherMaster::most_frames() const noexcept {
  nanoseconds newest{};
  for (const Sender& sender : senders_)
    if (sender.keeps_coming()) newest = std::max(newest, sender.last);
  const Sender* most = nullptr;
  for (const Sender& sender : senders_)
    if (sender.keeps_coming() && sender.recent(newest) && (most == nullptr || sender.frames > most->frames))
      most = &sender;
  return most;
}

std::string OtherMaster::order_text() const {
  const std::string slave = "slave " + std::to_string(order_.slave);
  if (order_.register_address == reg::kAlControl)
    return slave + " has a state that this program did not set, unless its firmware restarted";
  return "it wrote register " + register_text(order_.register_address) + " of " + slave;
}

std::string OtherMaster::describe() const {
  const Sender* const sender = most_frames();
  std::string evidence;
  if (sender != nullptr) evidence = std::to_string(sender->frames) + " frames from " + source();
  if (ordered_ && (sender == nullptr || last_order_ + kMemory >= sender->last))
    evidence += (evidence.empty() ? "" : "; ") + order_text();
  return "another EtherCAT master is on this bus (" + evidence +
         "): end that program, or unplug that machine";
}

std::string OtherMaster::source() const {
  const Sender* const sender = most_frames();
  if (sender == nullptr) return "unknown address";
  const MacAddress& source = sender->source;
  std::array<char, 24> text{};
  std::snprintf(text.data(), text.size(), "%02x:%02x:%02x:%02x:%02x:%02x", source[0], source[1], source[2],
                source[3], source[4], source[5]);
  return text.data();
}

}  // namespace drivers::ethercat
