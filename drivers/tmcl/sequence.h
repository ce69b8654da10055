/// @file
/// Things a drive has to be taken through step by step while the bus keeps cycling: commutation start-up,
/// homing, gripper motion, clearing of faults. No sequence does I/O, reads a clock, allocates or throws.
///
/// Each cycle the owner gives what the drive reports and, when it has come, the answer to the request the
/// sequence asked for; it gets what to command and at times a request for the drive's RequestQueue:
///
///   const Action action = sequence.step(input, answer);          // answer: null in most cycles
///   if (action.drive) output = *action.drive;
///   if (action.ask) queue.push(*action.ask, tag);
///   if (sequence.progress() == Progress::kFailed) log(describe(sequence.fault()), advice(sequence.fault()));
///
/// When push() finds no room, answer with a Completion of that request and Outcome::kNotSent. Give each
/// sequence a tag of its own, so that it does not see another's answers.
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
  kMailboxFailed,  ///< a request was refused, or not answered
  kTimeoutFlag,    ///< the drive's watchdog holds the motor
  kI2tFlag,
  kDriveError,      ///< another error flag
  kNotInitialized,  ///< commutation start-up did not end in time, or was lost
  kNotVerified,     ///< status bit 15 came, parameter 15 says no
  kNotAtRest,       ///< held still, goes on moving
  kNotMoving,       ///< commanded to move, stands still without current
  kWrongDirection,
  kTravelTooLong,      ///< farther than the joint is built to go
  kBlocked,            ///< does not come off what it touches
  kStopNotRepeatable,  ///< the second touch is elsewhere
  kMovedAtStop,        ///< not at rest while the counter is set
  kTooSlow,            ///< time is over
  kImplausible,        ///< a parameter read from the drive makes no sense
  kFlagStays,          ///< clearing was accepted, and the flag is still there
  kBadTarget,
  kNotKept,  ///< a parameter was accepted and reads back as another value
};
/// What happened, in words; and what to try.
const char* describe(SequenceFault fault) noexcept;
const char* advice(SequenceFault fault) noexcept;

struct Action {
  std::optional<DriveOutput> drive;  ///< empty: command what you like, nothing here moves this drive
  std::optional<Request> ask;
};

inline constexpr DriveOutput kStopMotor{ControllerMode::kMotorStop, 0};
inline constexpr DriveOutput kHoldStill{ControllerMode::kVelocity, 0};
inline constexpr DriveOutput kNoCurrent{ControllerMode::kCurrent, 0};

class Sequence {
 public:
  virtual ~Sequence() = default;

  /// Cycle. After the end it goes on giving the output to rest with.
  Action step(const DriveInput& input, const Completion* answer = nullptr) noexcept;
  /// Ends a running sequence with kCancelled; the next step() gives the output to rest with.
  void cancel() noexcept { fail(SequenceFault::kCancelled); }

  Progress progress() const noexcept { return progress_; }
  SequenceFault fault() const noexcept { return fault_; }

 protected:
  explicit Sequence(std::chrono::nanoseconds cycle) noexcept : cycle_(cycle) {}
  Sequence(const Sequence&) = default;
  Sequence& operator=(const Sequence&) = default;

  virtual Action run(const DriveInput& input) noexcept = 0;
  virtual std::optional<DriveOutput> rest(Progress progress) const noexcept = 0;

  /// Sends `request` on the first call and gives the reply's value when it has come; call it every cycle
  /// until then. Fails the sequence when the answer is no.
  std::optional<std::int32_t> ask(const Request& request, Action& action) noexcept;
  void finish() noexcept;
  void fail(SequenceFault fault) noexcept;
  /// Begins to count time anew.
  void restart_time() noexcept { cycles_ = 0; }
  /// Since restart_time(), in whole cycles.
  std::chrono::nanoseconds elapsed() const noexcept { return cycles_ * cycle_; }
  /// What the error flags forbid; kNone when there are none.
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
