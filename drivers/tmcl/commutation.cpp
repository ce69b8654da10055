#include "drivers/tmcl/commutation.h"

#include "drivers/tmcl/axis_parameters.h"

namespace drivers::tmcl {
namespace {

constexpr Request kIsInitialized = get(drive_parameter("initialize_joint"));

}  // namespace

std::optional<DriveOutput> Commutation::rest(Progress progress) const noexcept {
  return progress == Progress::kDone ? config_.rest : kStopMotor;
}

Action Commutation::run(const DriveInput& input) noexcept {
  const StatusFlag own = StatusFlag::kInitializationError;
  old_error_ = old_error_ && input.flags.has(own);
  const StatusFlags flags = old_error_ ? input.flags.without(own) : input.flags;
  if (const SequenceFault fault = fault_of(flags); fault != SequenceFault::kNone) {
    fail(fault);
    return {};
  }
  Action action{kStopMotor, std::nullopt};
  switch (state_) {
    case State::kAsk:
      if (const auto initialized = ask(kIsInitialized, action)) {
        was_initialized_ = *initialized == 1;
        if (was_initialized_) finish();
        state_ = State::kStart;
        restart_time();
      }
      break;

    case State::kStart:
      if (input.flags.has(StatusFlag::kInitialized)) {
        action.drive = config_.rest;
        state_ = State::kSettle;
        restart_time();
      } else if (elapsed() >= config_.timeout) {
        fail(SequenceFault::kNotInitialized);
      } else if (config_.firmware == Firmware::k148) {
        action.drive = {ControllerMode::kInitialize, 0};
      } else {
        action.drive = {ControllerMode::kVelocity, config_.velocity_rpm};
      }
      break;

    case State::kSettle:
      action.drive = config_.rest;
      if (elapsed() >= config_.settle) state_ = State::kVerify;
      break;

    case State::kVerify:
      action.drive = config_.rest;
      if (const auto initialized = ask(kIsInitialized, action)) {
        if (*initialized == 1) {
          finish();
        } else {
          fail(SequenceFault::kNotVerified);
        }
      }
      break;
  }
  return action;
}

}  // namespace drivers::tmcl
