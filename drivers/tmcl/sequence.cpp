#include "drivers/tmcl/sequence.h"

namespace drivers::tmcl {
namespace {

// A full queue of requests that all time out takes less; longer means that the owner has dropped the request.
constexpr auto kLongestAnswer = std::chrono::seconds(5);

}  // namespace

const char* describe(SequenceFault fault) noexcept {
  switch (fault) {
    case SequenceFault::kNone: return "no fault";
    case SequenceFault::kCancelled: return "cancelled";
    case SequenceFault::kMailboxFailed: return "a mailbox request was refused or not answered";
    case SequenceFault::kTimeoutFlag: return "the drive's watchdog has stopped it (process data timeout)";
    case SequenceFault::kI2tFlag: return "the motor has become too hot (I2t exceeded)";
    case SequenceFault::kDriveError: return "the drive reports an error";
    case SequenceFault::kNotInitialized: return "the commutation start-up did not succeed";
    case SequenceFault::kNotVerified:
      return "status bit 15 says commutation is known, parameter 15 says it is not";
    case SequenceFault::kNotAtRest: return "the joint does not come to rest although it is held";
    case SequenceFault::kNotMoving: return "the joint does not move, and no current says why";
    case SequenceFault::kWrongDirection: return "the joint moves against its command";
    case SequenceFault::kTravelTooLong: return "the joint went farther than it is built to go";
    case SequenceFault::kBlocked: return "the joint is blocked: it does not come off what it touches";
    case SequenceFault::kStopNotRepeatable: return "the end stop was not found in the same place twice";
    case SequenceFault::kMovedAtStop: return "the joint moved while its position was being set";
    case SequenceFault::kTooSlow: return "it took too long";
    case SequenceFault::kImplausible: return "a parameter of the drive makes no sense";
    case SequenceFault::kFlagStays: return "the flag was cleared and is still set";
    case SequenceFault::kBadTarget: return "the target is out of range";
    case SequenceFault::kNotKept: return "a parameter was accepted and reads back as another value";
  }
  return "an unknown fault";
}

const char* advice(SequenceFault fault) noexcept {
  switch (fault) {
    case SequenceFault::kNone:
    case SequenceFault::kCancelled: return "nothing to do";
    case SequenceFault::kMailboxFailed: return "try again; power-cycle the drive if it stays";
    case SequenceFault::kTimeoutFlag: return "keep process data flowing, then clear the flag explicitly";
    case SequenceFault::kI2tFlag: return "let the motor cool, then clear the flag explicitly";
    case SequenceFault::kDriveError: return "read the status flags";
    case SequenceFault::kNotInitialized:
      return "move the joint off its end stop by hand, check the 24 V supply, and try again";
    case SequenceFault::kNotVerified: return "power-cycle the robot";
    case SequenceFault::kNotAtRest: return "fold the arm by hand, and see what moves it";
    case SequenceFault::kNotMoving: return "check the encoder cable and that the drive is enabled";
    case SequenceFault::kWrongDirection:
      return "check parameters 251 (encoder direction) and 254 (hall polarity)";
    case SequenceFault::kTravelTooLong:
      return "the stop is missing, the current threshold too high, or the encoder counts wrong";
    case SequenceFault::kBlocked: return "free the joint by hand and move it away from its end stop";
    case SequenceFault::kStopNotRepeatable:
      return "look for an obstacle or cable in the way; fold the arm by hand";
    case SequenceFault::kMovedAtStop: return "fold the arm by hand, so that no weight pulls at the joint";
    case SequenceFault::kTooSlow:
      return "check for heavy friction, a low supply voltage and the speed settings";
    case SequenceFault::kImplausible: return "compare the drive's parameters with those of a healthy one";
    case SequenceFault::kFlagStays:
      return "its cause is still there: process data missing, or motor still hot";
    case SequenceFault::kBadTarget: return "correct the target";
    case SequenceFault::kNotKept: return "check that this firmware has the parameter, and its range";
  }
  return "";
}

Action Sequence::step(const DriveInput& input, const Completion* answer) noexcept {
  Action action;
  if (progress_ == Progress::kRunning) {
    answer_ = answer;
    action = run(input);
    answer_ = nullptr;
    ++cycles_;
  }
  if (progress_ != Progress::kRunning) return {rest(progress_), std::nullopt};
  return action;
}

std::optional<std::int32_t> Sequence::ask(const Request& request, Action& action) noexcept {
  if (!asked_) {
    asked_ = request;
    action.ask = request;
    cycles_since_ask_ = 0;
    return std::nullopt;
  }
  if (answer_ == nullptr || answer_->request != *asked_) {
    if (++cycles_since_ask_ * cycle_ > kLongestAnswer) fail(SequenceFault::kMailboxFailed);
    return std::nullopt;
  }
  asked_.reset();
  if (answer_->done()) return answer_->reply.value;
  fail(SequenceFault::kMailboxFailed);
  return std::nullopt;
}

void Sequence::finish() noexcept {
  if (progress_ == Progress::kRunning) progress_ = Progress::kDone;
}

void Sequence::fail(SequenceFault fault) noexcept {
  if (progress_ != Progress::kRunning) return;
  progress_ = Progress::kFailed;
  fault_ = fault;
}

SequenceFault Sequence::fault_of(StatusFlags flags) noexcept {
  if (flags.has(StatusFlag::kTimeout)) return SequenceFault::kTimeoutFlag;
  if (flags.has(StatusFlag::kI2tExceeded)) return SequenceFault::kI2tFlag;
  return flags.errors().any() ? SequenceFault::kDriveError : SequenceFault::kNone;
}

}  // namespace drivers::tmcl
