/// @file
/// The wire as the master uses it: complete Ethernet frames out and in.
#pragma once
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <thread>

#include "drivers/ethercat/monotonic_clock.h"

namespace drivers::ethercat {

/// Implementations: RawSocketLink (a network interface), the emulated bus of sim/bus (in process),
/// LockStepLink over either (virtual time), and decorators that damage selected frames in tests. One thread.
class Link {
 public:
  Link() = default;
  Link(const Link&) = delete;
  Link& operator=(const Link&) = delete;
  virtual ~Link() = default;

  /// Cycle: false if the frame could not be handed over (no cable, interface down); see last_error().
  virtual bool send(std::span<const std::uint8_t> frame) noexcept = 0;
  /// Cycle: copies the next received EtherCAT frame into `buffer`; returns its size, or 0 if none arrived
  /// within `timeout`. Our own outgoing frames are not delivered.
  virtual std::size_t receive(std::span<std::uint8_t> buffer, std::chrono::nanoseconds timeout) noexcept = 0;
  /// Cycle: how long that frame waited since it arrived; zero if unknown.
  virtual std::chrono::nanoseconds frame_age() const noexcept { return {}; }
  /// Monotonic clock for all deadlines on the wire: the machine's. An emulated bus overrides it with its own
  /// time, so that a busy machine makes no frame late.
  virtual std::chrono::nanoseconds now() const noexcept { return monotonic_now(); }
  /// Setup: sleeps on that clock.
  virtual void wait(std::chrono::nanoseconds duration) { std::this_thread::sleep_for(duration); }
  /// True if, after an interruption, another bus than the one that was set up may answer; its slaves must not
  /// be configured again then.
  virtual bool may_lead_elsewhere() const noexcept { return false; }
  /// errno of the last failure of send() or receive(), 0 if none.
  virtual int last_error() const noexcept = 0;
  /// For messages: "eth0".
  virtual const std::string& name() const noexcept = 0;
};

}  // namespace drivers::ethercat
