/// @file
/// Mailbox traffic during operation: requests wait here and travel in the cyclic frames.
#pragma once
#include <array>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <optional>

#include "drivers/tmcl/telegram.h"
#include "drivers/tmcl/transport.h"

namespace drivers::tmcl {

enum class Outcome : std::uint8_t {
  kDone,
  kRefused,   ///< see the reply's status
  kTimedOut,  ///< no matching reply arrived
  kNotSent,   ///< the transport never accepted it
};
const char* describe(Outcome outcome) noexcept;

struct Completion {
  Request request;
  std::uint32_t tag = 0;
  Outcome outcome = Outcome::kNotSent;
  Reply reply{};  ///< for kDone and kRefused
  /// Minimum time that the reply waited before it was fetched.
  std::chrono::nanoseconds reply_age{};

  bool done() const noexcept { return outcome == Outcome::kDone; }
};

/// Requests to one slave, one at a time and in order: slaves hold one telegram, and a reply does not name its
/// parameter. After a time-out the next request waits one more time-out, or for the late reply, so that this
/// is not mistaken for its own. Nothing is repeated; that is the owner's decision. Cycle: all of it. One
/// thread; other users go through the owner, who distinguishes answers by their tags.
///
///   queue.push(get(drive_parameter("motor_driver_temperature")), kTemperatureTag);
///   ...each cycle, between receiving and sending the frame:
///   queue.step(mailbox);
///   while (const auto completion = queue.pop()) ...
class RequestQueue {
 public:
  static constexpr std::size_t kCapacity = 16;
  /// 100 cycles of 1 ms, like the official driver.
  static constexpr std::uint32_t kDefaultTimeoutCycles = 100;

  explicit RequestQueue(std::uint32_t timeout_cycles = kDefaultTimeoutCycles) noexcept
      : timeout_cycles_(timeout_cycles) {}

  /// False if full. A place is free again once its completion has been popped.
  bool push(const Request& request, std::uint32_t tag = 0) noexcept;
  /// Reads replies, counts cycles, sends at most one request.
  void step(Transport& transport) noexcept;
  /// The oldest completion not popped yet.
  std::optional<Completion> pop() noexcept;
  /// Drops everything, popped or not: for a slave that has been away. Still waits for its late reply.
  void clear() noexcept;

  std::size_t size() const noexcept { return pushed_ - taken_; }
  /// Nothing to send and nothing awaited.
  bool idle() const noexcept { return pushed_ == completed_; }
  /// Replies that matched no request.
  std::uint64_t discarded() const noexcept { return discarded_; }

 private:
  Completion& entry(std::size_t number) noexcept { return entries_[number % kCapacity]; }
  void receive(Transport& transport) noexcept;
  void complete(Outcome outcome) noexcept;

  // Entries are numbered in order: taken_ <= completed_ <= pushed_ <= taken_ + kCapacity.
  std::array<Completion, kCapacity> entries_{};
  std::size_t pushed_ = 0;
  std::size_t completed_ = 0;
  std::size_t taken_ = 0;
  std::uint32_t timeout_cycles_;
  std::uint32_t waited_cycles_ = 0;
  std::uint32_t late_cycles_ = 0;  // remaining wait for a late reply
  bool outstanding_ = false;       // entry completed_ has been handed over
  std::uint64_t discarded_ = 0;
};

}  // namespace drivers::tmcl
