/// @file
/// A link in virtual time: to youbot-sim --lock-step only.
#pragma once
#include <chrono>
#include <cstdint>
#include <memory>
#include <span>
#include <string>

#include "drivers/ethercat/link.h"

namespace drivers::ethercat {

inline constexpr std::chrono::seconds kLockStepPatience{5};

/// Each frame advances the simulation by kLockStepPeriod, and this link's clock with it. Every time-out above
/// the link counts simulated time, so a busy machine makes no answer late. wait() sends frames until the
/// simulated time has passed.
/// If the simulation leaves a frame unanswered for kLockStepPatience (last_error() is ETIME, also if the
/// interface went down meanwhile) or the link below refuses a frame (its error), it counts as gone: send()
/// refuses every further frame at once, because another bus may answer later. One thread; send() and
/// receive() are cycle-safe.
class LockStepLink final : public Link {
 public:
  /// Scans the bus and sets the simulated wheels on the ground or lifts them off it.
  /// @throws BusError naming the first slave that is not marked as simulated in lock-step. All slaves are
  /// still in their original state then: a real robot is never driven in virtual time.
  LockStepLink(std::unique_ptr<Link> link, bool lifted);

  bool send(std::span<const std::uint8_t> frame) noexcept override;
  std::size_t receive(std::span<std::uint8_t> buffer, std::chrono::nanoseconds timeout) noexcept override;
  std::chrono::nanoseconds now() const noexcept override { return now_; }
  void wait(std::chrono::nanoseconds duration) noexcept override;
  bool may_lead_elsewhere() const noexcept override { return true; }
  int last_error() const noexcept override { return gone_ != 0 ? gone_ : link_->last_error(); }
  const std::string& name() const noexcept override { return link_->name(); }

 private:
  std::unique_ptr<Link> link_;
  std::chrono::nanoseconds now_{};
  bool under_way_ = false;  // a frame is unanswered
  std::uint8_t index_ = 0;  // of its first datagram, repeated in the answer
  int gone_ = 0;            // errno that ended the simulation
};

}  // namespace drivers::ethercat
