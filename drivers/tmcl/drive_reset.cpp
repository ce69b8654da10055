#include "drivers/tmcl/drive_reset.h"

#include "drivers/tmcl/axis_parameters.h"

namespace drivers::tmcl {
namespace {

// The drive ignores the value; 1 is what the official driver sends.
constexpr Request kClearTimeout = set(drive_parameter("clear_motor_controller_timeout_flag"), 1);
constexpr Request kClearI2t = set(drive_parameter("clear_i2t_exceeded_flag"), 1);
constexpr Request kReadThermalTime = get(drive_parameter("thermal_winding_time_constant"));
// 13.2 s is typical. Zero would mean no cooling at all, and ten minutes is more than anyone waits.
constexpr std::int32_t kLongestThermalTime_ms = 600'000;

}  // namespace

Action TimeoutReset::run(const DriveInput& input) noexcept {
  Action action{kStopMotor, std::nullopt};
  switch (state_) {
    case State::kStop:
      if (!input.flags.has(StatusFlag::kTimeout)) finish();
      if (elapsed() >= config_.stop_first) state_ = State::kClear;
      break;
    case State::kClear:
      if (ask(kClearTimeout, action)) {
        state_ = State::kVerify;
        restart_time();
      }
      break;
    case State::kVerify:
      if (!input.flags.has(StatusFlag::kTimeout)) {
        finish();
      } else if (elapsed() >= config_.patience) {
        fail(SequenceFault::kFlagStays);
      }
      break;
  }
  return action;
}

std::chrono::nanoseconds I2tReset::remaining() const noexcept {
  return state_ == State::kCool && elapsed() < cooling_ ? cooling_ - elapsed() : std::chrono::nanoseconds(0);
}

Action I2tReset::run(const DriveInput& input) noexcept {
  Action action{kStopMotor, std::nullopt};
  switch (state_) {
    case State::kReadTime:
      if (!input.flags.has(StatusFlag::kI2tExceeded)) {
        finish();
      } else if (const auto time_ms = ask(kReadThermalTime, action)) {
        if (*time_ms <= 0 || *time_ms > kLongestThermalTime_ms) fail(SequenceFault::kImplausible);
        cooling_ = std::chrono::milliseconds(*time_ms) + config_.cooling_margin;
        state_ = State::kCool;
        restart_time();
      }
      break;
    case State::kCool:
      if (elapsed() >= cooling_) state_ = State::kClear;
      break;
    case State::kClear:
      if (ask(kClearI2t, action)) {
        state_ = State::kVerify;
        restart_time();
      }
      break;
    case State::kVerify:
      if (!input.flags.has(StatusFlag::kI2tExceeded)) {
        finish();
      } else if (elapsed() >= config_.patience) {
        fail(SequenceFault::kFlagStays);
      }
      break;
  }
  return action;
}

}  // namespace drivers::tmcl
