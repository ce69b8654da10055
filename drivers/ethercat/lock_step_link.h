/// @file
/// A link in virtual time: to youbot-sim --lock-step and to nothing else.
#pragma once
#include <cerrno>
#include <chrono>
#include <cstdint>
#include <memory>
#include <span>
#include <string>

#include "drivers/ethercat/link.h"

namespace drivers::ethercat {

inline constexpr std::chrono::seconds kLockStepPatience{5};

/// The simulation's time goes with the frames (kLockStepPeriod each), and so does this link's clock. Nothing
/// is late on it: an answer may take kLockStepPatience, however busy the machine is, and every time-out above
/// the link counts simulated time. wait() sends the frames that let that time pass.
///
/// After that silence the simulation is gone: from then on send() refuses every frame with ETIME at once,
/// until a new link is opened. One thread; send() and receive() are cycle-safe.
class LockStepLink final : public Link {
 public:
  /// Scans the bus and puts the simulated wheels on the ground or lifts them off it.
  /// @throws BusError naming the first slave that does not say that it is simulated in lock-step. No slave
  /// has been asked to leave its state by then: no robot is ever driven in virtual time.
  LockStepLink(std::unique_ptr<Link> link, bool lifted);

  bool send(std::span<const std::uint8_t> frame) noexcept override;
  std::size_t receive(std::span<std::uint8_t> buffer, std::chrono::nanoseconds timeout) noexcept override;
  std::chrono::nanoseconds now() const noexcept override { return now_; }
  void wait(std::chrono::nanoseconds duration) noexcept override;
  bool may_lead_elsewhere() const noexcept override { return true; }
  int last_error() const noexcept override { return gone_ ? ETIME : link_->last_error(); }
  const std::string& name() const noexcept override { return link_->name(); }

 private:
  std::unique_ptr<Link> link_;
  std::chrono::nanoseconds now_{};
  bool under_way_ = false;  // a frame that has no answer yet
  std::uint8_t index_ = 0;  // of its first datagram, by which its answer is known
  bool gone_ = false;
};

}  // namespace drivers::ethercat
