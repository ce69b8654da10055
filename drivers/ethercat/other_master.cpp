#include "drivers/ethercat/other_master.h"

#include <array>
#include <cstdio>

namespace drivers::ethercat {
namespace {

using std::chrono::nanoseconds;

constexpr std::uint64_t kFewestFrames = 3;
/// What a program that has ended left on the wire comes in one burst.
constexpr std::chrono::milliseconds kShortestStay{10};
constexpr std::chrono::seconds kMemory{1};

}  // namespace

void OtherMaster::note_frame(MacAddress source, nanoseconds now) noexcept {
  source[0] &= static_cast<std::uint8_t>(~kReturnedBit);
  if (frames_ == 0 || source != source_ || now - last_ > kMemory) {
    source_ = source;
    frames_ = 0;
    first_ = now;
  }
  ++frames_;
  last_ = now;
}

void OtherMaster::note_order(nanoseconds now) noexcept {
  ordered_ = true;
  last_order_ = now;
}

bool OtherMaster::present(nanoseconds now) const noexcept {
  const bool sends = frames_ >= kFewestFrames && last_ - first_ >= kShortestStay && now - last_ <= kMemory;
  return sends || (ordered_ && now - last_order_ <= kMemory);
}

std::string OtherMaster::describe() const {
  const std::string evidence =
      frames_ >= kFewestFrames ? std::to_string(frames_) + " frames from " + source()
                               : "a slave has a state or a station address that this program did not set, "
                                 "unless its firmware restarted";
  return "another EtherCAT master is on this bus (" + evidence +
         "): end that program, or unplug that machine";
}

std::string OtherMaster::source() const {
  if (frames_ < kFewestFrames) return "unknown address";
  std::array<char, 24> text{};
  std::snprintf(text.data(), text.size(), "%02x:%02x:%02x:%02x:%02x:%02x", source_[0], source_[1], source_[2],
                source_[3], source_[4], source_[5]);
  return text.data();
}

}  // namespace drivers::ethercat
