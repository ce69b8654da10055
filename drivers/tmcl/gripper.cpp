#include "drivers/tmcl/gripper.h"

namespace drivers::tmcl {
namespace {

constexpr Request kIsCalibrated = get_user_variable(user_variable::kCalibrated, kGripperModule);
constexpr Request kRememberCalibrated = set_user_variable(user_variable::kCalibrated, 1, kGripperModule);

constexpr std::array<Request, kGripperBars> kHaveArrived{
    get(gripper_parameter("target_position_reached"), 0),
    get(gripper_parameter("target_position_reached"), 1)};
constexpr std::array<Request, kGripperBars> kReadPositions{gripper_position(0), gripper_position(1)};
constexpr std::array<Request, kGripperBars> kZeroPositions{set(gripper_parameter("actual_position"), 0, 0),
                                                           set(gripper_parameter("actual_position"), 0, 1)};
constexpr std::array<Request, kGripperBars> kStopBars{Request{kGripperModule, Command::kMotorStop, 0, 0, 0},
                                                      Request{kGripperModule, Command::kMotorStop, 0, 1, 0}};

}  // namespace

const char* name(GripperFlag flag) noexcept {
  switch (flag) {
    case GripperFlag::kStallGuard: return "stall threshold reached";
    case GripperFlag::kOvertemperature: return "overtemperature";
    case GripperFlag::kOvertemperatureWarning: return "overtemperature warning";
    case GripperFlag::kShortToGroundA: return "short to ground, coil A";
    case GripperFlag::kShortToGroundB: return "short to ground, coil B";
    case GripperFlag::kOpenLoadA: return "open load, coil A";
    case GripperFlag::kOpenLoadB: return "open load, coil B";
    case GripperFlag::kStandstill: return "standstill";
  }
  return "unknown flag";
}

bool GripperSequence::ask_both(const BarRequests& requests, Action& action) noexcept {
  if (const auto answer = ask(requests[bar_], action)) {
    values_[bar_] = *answer;
    ++bar_;
  }
  if (bar_ < kGripperBars) return false;
  bar_ = 0;
  return true;
}

bool GripperSequence::both_arrived(Action& action) noexcept {
  if (elapsed() >= config_.timeout) {
    fail(SequenceFault::kTooSlow);
    return false;
  }
  if (elapsed() < next_poll_ || !ask_both(kHaveArrived, action)) return false;
  next_poll_ = elapsed() + config_.poll_interval;
  if (values_[0] != 1 || values_[1] != 1) return false;
  next_poll_ = std::chrono::nanoseconds(0);
  return true;
}

GripperMotion::GripperMotion(std::int32_t opening, const GripperConfig& config,
                             std::chrono::nanoseconds cycle) noexcept
    : GripperSequence(config, cycle), opening_(opening) {
  if (opening < 0 || opening > config.travel) fail(SequenceFault::kBadTarget);
}

Action GripperMotion::run(const DriveInput& /*input*/) noexcept {
  Action action;
  switch (state_) {
    case State::kMove:
      if (ask_both({gripper_move_to(0, opening_), gripper_move_to(1, opening_)}, action)) {
        state_ = State::kWait;
        restart_time();
      }
      break;
    case State::kWait:
      if (both_arrived(action)) state_ = State::kRead;
      break;
    case State::kRead:
      if (ask_both(kReadPositions, action)) finish();
      break;
  }
  return action;
}

Action GripperStop::run(const DriveInput& /*input*/) noexcept {
  Action action;
  if (ask_both(kStopBars, action)) finish();
  return action;
}

Action GripperCalibration::run(const DriveInput& /*input*/) noexcept {
  Action action;
  switch (state_) {
    case State::kAsk:
      if (repeat_ == Repeat::kAlways) {
        state_ = State::kOpen;
      } else if (const auto calibrated = ask(kIsCalibrated, action)) {
        if (*calibrated == 1) finish();
        state_ = State::kOpen;
      }
      break;
    case State::kOpen:
      if (ask_both({gripper_open_by(0, config_.travel), gripper_open_by(1, config_.travel)}, action)) {
        state_ = State::kWaitOpen;
        restart_time();
      }
      break;
    case State::kWaitOpen:
      if (both_arrived(action)) state_ = State::kClose;
      break;
    case State::kClose:
      if (ask_both({gripper_open_by(0, -config_.travel), gripper_open_by(1, -config_.travel)}, action)) {
        state_ = State::kWaitClosed;
        restart_time();
      }
      break;
    case State::kWaitClosed:
      if (both_arrived(action)) state_ = State::kZero;
      break;
    case State::kZero:
      if (ask_both(kZeroPositions, action)) state_ = State::kRemember;
      break;
    case State::kRemember:
      if (ask(kRememberCalibrated, action)) finish();
      break;
  }
  return action;
}

}  // namespace drivers::tmcl
