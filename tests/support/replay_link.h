/// @file
/// A captured bus instead of a real one.
#pragma once
#include <algorithm>
#include <chrono>
#include <cstdint>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "drivers/ethercat/frame.h"
#include "drivers/ethercat/link.h"
#include "tests/support/capture_file.h"

namespace support {

/// Answers a master from the capture, at the capture's times, as long as the master sends the captured
/// frames: each must be equal byte by byte. The only difference is the source address, which each master
/// draws at random (unique_master_mac()): the replies carry the new one. difference() describes the first
/// differing frame, and from then on the bus is silent.
///
/// Time is the capture's and advances in receive(), wait() and advance_to(): a replay takes none.
class ReplayLink final : public drivers::ethercat::Link {
 public:
  using Bytes = std::vector<std::uint8_t>;

  explicit ReplayLink(std::vector<CapturedFrame> frames) : frames_(std::move(frames)) {}

  bool send(std::span<const std::uint8_t> frame) noexcept override {
    sent.emplace_back(frame.begin(), frame.end());
    if (difference_.empty()) compare(sent.back());
    return true;
  }
  std::size_t receive(std::span<std::uint8_t> buffer, std::chrono::nanoseconds timeout) noexcept override {
    const bool comes = difference_.empty() && next_ < frames_.size() &&
                       frames_[next_].direction == drivers::ethercat::Direction::kReceived &&
                       frames_[next_].stamp <= now_ + timeout;
    if (!comes) {
      now_ += timeout;
      return 0;
    }
    const CapturedFrame& frame = frames_[next_++];
    now_ = std::max(now_, frame.stamp);
    const std::size_t size = std::min(frame.bytes.size(), buffer.size());
    std::copy_n(frame.bytes.begin(), size, buffer.begin());
    if (size >= kSourceEnd && is_reply(frame.bytes)) {
      std::copy_n(sent.back().begin() + kSource, kSourceEnd - kSource, buffer.begin() + kSource);
      buffer[kSource] |= drivers::ethercat::kReturnedBit;
    }
    return size;
  }
  std::chrono::nanoseconds now() const noexcept override { return now_; }
  void wait(std::chrono::nanoseconds duration) override { now_ += duration; }
  int last_error() const noexcept override { return 0; }
  const std::string& name() const noexcept override { return name_; }

  void advance_to(std::chrono::nanoseconds time) noexcept { now_ = std::max(now_, time); }
  /// Empty as long as the master sends the captured frames.
  const std::string& difference() const noexcept { return difference_; }
  bool at_end() const noexcept { return next_ == frames_.size(); }

  std::vector<Bytes> sent;

 private:
  static constexpr std::size_t kSource = drivers::ethercat::kSourceMacOffset;
  static constexpr std::size_t kSourceEnd = kSource + drivers::ethercat::MacAddress().size();

  void compare(const Bytes& frame) {
    const std::string number = "frame " + std::to_string(next_);
    if (next_ == frames_.size()) {
      difference_ = number + ": sent after the end of the capture";
    } else if (frames_[next_].direction != drivers::ethercat::Direction::kSent) {
      difference_ = number + ": sent before the reply was taken";
    } else {
      Bytes expected = frames_[next_].bytes;
      std::copy_n(frame.begin() + kSource, kSourceEnd - kSource, expected.begin() + kSource);
      const auto [here, there] = std::mismatch(expected.begin(), expected.end(), frame.begin(), frame.end());
      if (here == expected.end() && there == frame.end())
        ++next_;
      else
        difference_ = number + ": differs from byte " + std::to_string(here - expected.begin()) + " on";
    }
  }
  /// True for our own frame, false for another master's.
  bool is_reply(const Bytes& frame) const {
    const Bytes& ours = frames_.front().bytes;
    return (frame[kSource] & ~drivers::ethercat::kReturnedBit) == ours[kSource] &&
           std::equal(frame.begin() + kSource + 1, frame.begin() + kSourceEnd, ours.begin() + kSource + 1);
  }

  const std::vector<CapturedFrame> frames_;
  std::size_t next_ = 0;
  std::chrono::nanoseconds now_{};
  std::string difference_;
  const std::string name_ = "capture";
};

}  // namespace support
