/// @file
/// The wire as the master sees it: whole Ethernet frames out, whole frames in.
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
/// LockStepLink over either (virtual time), and decorators that spoil chosen frames in tests. One thread.
class Link {
 public:
  Link() = default;
  Link(const Link&) = delete;
  Link& operator=(const Link&) = delete;
  virtual ~Link() = default;

  /// Cycle: false when the frame could not be handed over (cable out, interface down); see last_error().
  virtual bool send(std::span<const std::uint8_t> frame) noexcept = 0;
  /// Cycle: the next EtherCAT frame that came back, copied into `buffer`; its size, or 0 when none came
  /// before `timeout` was over. Frames of our own as they go out are not delivered.
  virtual std::size_t receive(std::span<std::uint8_t> buffer, std::chrono::nanoseconds timeout) noexcept = 0;
  /// Cycle: how long that frame has waited since it came in; zero where that is not known.
  virtual std::chrono::nanoseconds frame_age() const noexcept { return {}; }
  /// Monotonic clock of all deadlines on the wire: the machine's. An emulated bus overrides it with its own
  /// time, so that a busy machine makes no frame late.
  virtual std::chrono::nanoseconds now() const noexcept { return monotonic_now(); }
  /// Setup: sleeps on that clock.
  virtual void wait(std::chrono::nanoseconds duration) { std::this_thread::sleep_for(duration); }
  /// Whether what answers after a break may be another bus than the one that was set up, so that none of its
  /// slaves may be configured again.
  virtual bool may_lead_elsewhere() const noexcept { return false; }
  /// errno of the last failure of send() or receive(), 0 if none.
  virtual int last_error() const noexcept = 0;
  /// For messages: "eth0".
  virtual const std::string& name() const noexcept = 0;
};

}  // namespace drivers::ethercat
