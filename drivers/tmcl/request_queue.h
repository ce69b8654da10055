/// @file
/// Mailbox traffic during operation: requests wait here and ride along with the cyclic frames.
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
  kTimedOut,  ///< nothing that matches has come
  kNotSent,   ///< the transport never took it
};
const char* describe(Outcome outcome) noexcept;

struct Completion {
  Request request;
  std::uint32_t tag = 0;
  Outcome outcome = Outcome::kNotSent;
  Reply reply{};  ///< of kDone and kRefused
  /// How long that had been there at least, unfetched.
  std::chrono::nanoseconds reply_age{};

  bool done() const noexcept { return outcome == Outcome::kDone; }
};

/// The requests to one slave, one at a time and in order: the slaves hold one telegram, and a reply does not
/// name its parameter. After a time-out the next request waits as long again, or for the late reply, so that
/// this is not taken for its own. Nothing is repeated; that is the owner's decision. Cycle: all of it. One
/// thread; who else wants to ask goes through the owner, who tells answers apart by their tags.
///
///   queue.push(get(drive_parameter("motor_driver_temperature")), kTemperatureTag);
///   ...each cycle, between receiving and sending the frame:
///   queue.step(mailbox);
///   while (const auto completion = queue.pop()) ...
class RequestQueue {
 public:
  static constexpr std::size_t kCapacity = 16;
  /// 100 cycles of 1 ms: as long as the official driver waits.
  static constexpr std::uint32_t kDefaultTimeoutCycles = 100;

  explicit RequestQueue(std::uint32_t timeout_cycles = kDefaultTimeoutCycles) noexcept
      : timeout_cycles_(timeout_cycles) {}

  /// False when full. A place is free again when the completion has been taken.
  bool push(const Request& request, std::uint32_t tag = 0) noexcept;
  /// Takes in replies, counts cycles, hands over at most one request.
  void step(Transport& transport) noexcept;
  /// The oldest completion not taken yet.
  std::optional<Completion> pop() noexcept;
  /// Forgets everything, taken or not: for a slave that has been away. Its late reply is still waited for.
  void clear() noexcept;

  std::size_t size() const noexcept { return pushed_ - taken_; }
  /// Nothing to send and nothing awaited.
  bool idle() const noexcept { return pushed_ == completed_; }
  /// Replies that answered nothing that was asked.
  std::uint64_t discarded() const noexcept { return discarded_; }

 private:
  Completion& entry(std::size_t number) noexcept { return entries_[number % kCapacity]; }
  void receive(Transport& transport) noexcept;
  void complete(Outcome outcome) noexcept;

  // Entries are numbered as they come: taken_ <= completed_ <= pushed_ <= taken_ + kCapacity.
  std::array<Completion, kCapacity> entries_{};
  std::size_t pushed_ = 0;
  std::size_t completed_ = 0;
  std::size_t taken_ = 0;
  std::uint32_t timeout_cycles_;
  std::uint32_t waited_cycles_ = 0;
  std::uint32_t late_cycles_ = 0;  // left to wait for a late reply
  bool outstanding_ = false;       // entry completed_ has been handed over
  std::uint64_t discarded_ = 0;
};

}  // namespace drivers::tmcl
