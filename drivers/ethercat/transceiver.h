/// @file
/// Sends a frame and finds its answer among the received frames.
#pragma once
#include <array>
#include <bitset>
#include <chrono>
#include <cstdint>

#include "drivers/ethercat/frame.h"
#include "drivers/ethercat/frame_tap.h"
#include "drivers/ethercat/link.h"
#include "drivers/ethercat/other_master.h"

namespace drivers::ethercat {

/// Maximum number of other frames in one wait: a flood of them must not delay the cycle.
inline constexpr int kMaxStrangers = 64;

struct FrameCounters {
  std::uint64_t sent = 0;
  std::uint64_t received = 0;   ///< answers to the awaited frame
  std::uint64_t not_sent = 0;   ///< the interface refused
  std::uint64_t lost = 0;       ///< no answer within the time-out
  std::uint64_t late = 0;       ///< first answer to a frame after its time-out: one of `lost`
  std::uint64_t duplicate = 0;  ///< any further answer, or one with a damaged index
  std::uint64_t malformed = 0;  ///< not a well-formed EtherCAT frame
  std::uint64_t foreign = 0;    ///< well-formed, from another sender
  /// errno for which the interface refuses frames now, from the first refused frame since one was accepted.
  /// 0: it accepts them.
  int link_error = 0;
};

/// One frame is under way at a time. All its datagrams carry the frame's index; an answer must have it, come
/// from our own source address and contain the same datagrams in the same order. One thread; cycle-safe
/// except the constructor.
class Transceiver {
 public:
  explicit Transceiver(Link& link, FrameTap* tap = nullptr)
      : link_(link), tap_(tap), writer_(unique_master_mac()) {}

  /// Starts a new frame: add datagrams to it, all with index().
  FrameWriter& begin() noexcept;
  std::uint8_t index() const noexcept { return index_; }

  /// Sends the current frame. False if the interface refused it.
  bool send() noexcept;
  /// Waits up to `timeout` for the answer to the sent frame. False if none arrived.
  bool receive(std::chrono::nanoseconds timeout) noexcept;
  bool exchange(std::chrono::nanoseconds timeout) noexcept { return send() && receive(timeout); }
  /// The answer's datagrams, from the first; valid after receive() returned true, until begin().
  FrameReader answer() noexcept;
  /// From sending to the answer, for the last receive() that returned true.
  std::chrono::nanoseconds round_trip() const noexcept { return round_trip_; }

  /// Time that the answer waited before it was fetched.
  std::chrono::nanoseconds answer_age() const noexcept { return answer_age_; }

  const FrameCounters& counters() const noexcept { return counters_; }
  OtherMaster& other_master() noexcept { return other_master_; }
  const OtherMaster& other_master() const noexcept { return other_master_; }
  Link& link() noexcept { return link_; }

 private:
  enum class Match { kAnswer, kOther };
  Match examine(std::span<std::uint8_t> frame) noexcept;
  bool is_foreign(std::span<const std::uint8_t> frame) noexcept;

  Link& link_;
  FrameTap* tap_;
  FrameWriter writer_;
  std::array<std::uint8_t, kMaxFrameBytes> sent_{};
  std::size_t sent_size_ = 0;
  std::array<std::uint8_t, kMaxFrameBytes + 8> received_{};
  std::size_t received_size_ = 0;
  std::uint8_t index_ = 0;
  std::bitset<256> given_up_;  // per index: the last frame with it is unanswered
  std::chrono::nanoseconds sent_at_{};
  std::chrono::nanoseconds round_trip_{};
  std::chrono::nanoseconds answer_age_{};
  FrameCounters counters_;
  OtherMaster other_master_;
};

}  // namespace drivers::ethercat
