/// @file
/// How telegrams reach a module and come back. Carriers: CanTransport, the EtherCAT mailbox of a slave.
#pragma once
#include <chrono>
#include <cstdint>
#include <optional>
#include <string>

#include "drivers/tmcl/telegram.h"

namespace drivers::tmcl {

/// One module's mailbox. Neither call waits, so both can ride in a cyclic frame. One thread.
class Transport {
 public:
  Transport() = default;
  Transport(const Transport&) = delete;
  Transport& operator=(const Transport&) = delete;
  virtual ~Transport() = default;

  /// Cycle: hands the request over. False when it could not be (mailbox full, bus off): try again later.
  virtual bool post(const Request& request) noexcept = 0;
  /// Cycle: the next reply that has come, whatever it answers.
  virtual std::optional<Reply> poll() noexcept = 0;
  /// Cycle: how long the last reply had been there before poll() gave it; zero where it is not known.
  virtual std::chrono::nanoseconds reply_age() const noexcept { return {}; }
  /// For messages: "slave 3 (TMCM-1632)".
  virtual const std::string& name() const noexcept = 0;
  /// Setup: what is wrong with the carrier, in words ("bus off"); empty when nothing is known.
  virtual std::string trouble() const { return {}; }
};

/// Time on the set-up path. An emulated bus runs its cycles in wait(); tests do not sleep.
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
  std::optional<Reply> reply;  ///< one that matches, possibly a refusal
  int discarded = 0;           ///< replies that answer something else
  std::optional<Reply> discarded_last;
};

/// Setup: posts and waits for the matching reply until `deadline`, looking every `interval`. Replies that
/// were waiting before are stale and dropped without count. Ends early when text was asked for and zeros
/// came: it takes another request to get the text.
Exchange exchange(Transport& transport, Clock& clock, const Request& request,
                  std::chrono::nanoseconds deadline, std::chrono::nanoseconds interval) noexcept;

}  // namespace drivers::tmcl
