/// @file
/// Transport of telegrams to and from a module. Carriers: CanTransport, the EtherCAT mailbox of a slave.
#pragma once
#include <chrono>
#include <cstdint>
#include <optional>
#include <string>

#include "drivers/tmcl/telegram.h"

namespace drivers::tmcl {

/// One module's mailbox. No call blocks, so both can be used with a cyclic frame. One thread.
class Transport {
 public:
  Transport() = default;
  Transport(const Transport&) = delete;
  Transport& operator=(const Transport&) = delete;
  virtual ~Transport() = default;

  /// Cycle: hands the request over. False if it was not accepted (mailbox full, bus off): try again later.
  virtual bool post(const Request& request) noexcept = 0;
  /// Cycle: the next received reply, whatever it answers.
  virtual std::optional<Reply> poll() noexcept = 0;
  /// Cycle: how long the last reply waited before poll() returned it; zero if unknown.
  virtual std::chrono::nanoseconds reply_age() const noexcept { return {}; }
  /// For messages: "slave 3 (TMCM-1632)".
  virtual const std::string& name() const noexcept = 0;
  /// Setup: text on a fault of the carrier ("bus off"); empty if none is known.
  virtual std::string transport_fault() const { return {}; }
};

/// Time in set-up. An emulated bus runs its cycles in wait(); tests do not sleep.
class Clock {
 public:
  virtual ~Clock() = default;
  virtual std::chrono::nanoseconds now() noexcept = 0;
  virtual void wait(std::chrono::nanoseconds duration) noexcept = 0;
};

/// CLOCK_MONOTONIC; wait() sleeps.
class SteadyClock final : public Clock {
 public:
  std::chrono::nanoseconds now() noexcept override;
  void wait(std::chrono::nanoseconds duration) noexcept override;
};

struct Exchange {
  bool posted = false;
  std::optional<Reply> reply;  ///< a matching one, possibly a refusal
  int discarded = 0;           ///< replies to something else
  std::optional<Reply> discarded_last;
};

/// Setup: posts and waits for the matching reply until `deadline`, polling every `interval`. Replies that
/// were waiting before are stale; they are dropped and not counted. Ends early if text was requested and
/// zeros arrived: the text needs another request.
Exchange exchange(Transport& transport, Clock& clock, const Request& request,
                  std::chrono::nanoseconds deadline, std::chrono::nanoseconds interval) noexcept;

}  // namespace drivers::tmcl
