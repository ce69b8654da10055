/// @file
/// Procedures that take a drive through several steps while the bus keeps cycling: commutation start-up,
/// homing, gripper motion, clearing of faults. No sequence does I/O, reads a clock, allocates or throws.
///
/// Each cycle the owner passes the drive's inputs and, once it has arrived, the answer to the sequence's
/// request; it gets the command and sometimes a request for the drive's RequestQueue:
///
///   const Action action = sequence.step(input, answer);          // answer: null in most cycles
///   if (action.drive) output = *action.drive;
///   if (action.ask) queue.push(*action.ask, tag);
///   if (sequence.progress() == Progress::kFailed) log(describe(sequence.fault()), advice(sequence.fault()));
///
/// If push() finds no room, answer with a Completion of that request and Outcome::kNotSent. Give each
/// sequence its own tag, so that it does not see another's answers.
#pragma once
#include <chrono>
#include <cstdint>
#include <optional>

#include "drivers/tmcl/process_data.h"
#include "drivers/tmcl/request_queue.h"

namespace drivers::tmcl {

enum class Progress : std::uint8_t { kRunning, kDone, kFailed };

enum class SequenceFault : std::uint8_t {
  kNone,
  kCancelled,
  kMailboxFailed,  ///< a request was refused or not answered
  kTimeoutFlag,    ///< the drive's watchdog holds the motor
  kI2tFlag,
  kDriveError,      ///< another error flag
  kNotInitialized,  ///< commutation start-up did not end in time, or commutation was lost
  kNotVerified,     ///< status bit 15 is set, but parameter 15 says no
  kNotAtRest,       ///< commanded to hold still, keeps moving
  kNotMoving,       ///< commanded to move, at rest without current
  kWrongDirection,
  kTravelTooLong,      ///< further than the joint's range
  kBlocked,            ///< does not come off the stop
  kStopNotRepeatable,  ///< the second touch is at another position
  kMovedAtStop,        ///< not at rest while the counter is set
  kTooSlow,            ///< time-out
  kImplausible,        ///< a parameter read from the drive is implausible
  kFlagStays,          ///< clearing was accepted, but the flag is still set
  kBadTarget,
  kNotKept,  ///< a parameter was accepted but reads back differently
};
/// What happened, and what to try.
const char* describe(SequenceFault fault) noexcept;
const char* advice(SequenceFault fault) noexcept;

struct Action {
  std::optional<DriveOutput> drive;  ///< empty: this sequence does not command the drive
  std::optional<Request> ask;
};

inline constexpr DriveOutput kStopMotor{ControllerMode::kMotorStop, 0};
inline constexpr DriveOutput kHoldStill{ControllerMode::kVelocity, 0};
inline constexpr DriveOutput kNoCurrent{ControllerMode::kCurrent, 0};

class Sequence {
 public:
  virtual ~Sequence() = default;

  /// Cycle. After the end it keeps returning the rest output.
  Action step(const DriveInput& input, const Completion* answer = nullptr) noexcept;
  /// Ends a running sequence with kCancelled; the next step() returns the rest output.
  void cancel() noexcept { fail(SequenceFault::kCancelled); }

  Progress progress() const noexcept { return progress_; }
  SequenceFault fault() const noexcept { return fault_; }

 protected:
  explicit Sequence(std::chrono::nanoseconds cycle) noexcept : cycle_(cycle) {}
  Sequence(const Sequence&) = default;
  Sequence& operator=(const Sequence&) = default;

  virtual Action run(const DriveInput& input) noexcept = 0;
  virtual std::optional<DriveOutput> rest(Progress progress) const noexcept = 0;

  /// Sends `request` on the first call and returns the reply's value once it has arrived; call it every cycle
  /// until then. Fails the sequence if the request is refused.
  std::optional<std::int32_t> ask(const Request& request, Action& action) noexcept;
  void finish() noexcept;
  void fail(SequenceFault fault) noexcept;
  /// Restarts the time count.
  void restart_time() noexcept { cycles_ = 0; }
  /// Since restart_time(), in whole cycles.
  std::chrono::nanoseconds elapsed() const noexcept { return cycles_ * cycle_; }
  /// The fault for the error flags; kNone if no flag is set.
  static SequenceFault fault_of(StatusFlags flags) noexcept;

 private:
  std::chrono::nanoseconds cycle_;
  std::int64_t cycles_ = 0;
  std::int64_t cycles_since_ask_ = 0;
  const Completion* answer_ = nullptr;  // during step()
  std::optional<Request> asked_;
  Progress progress_ = Progress::kRunning;
  SequenceFault fault_ = SequenceFault::kNone;
};

}  // namespace drivers::tmcl
