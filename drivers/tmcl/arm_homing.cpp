#include "drivers/tmcl/arm_homing.h"

#include <cstdlib>

#include "drivers/tmcl/axis_parameters.h"

namespace drivers::tmcl {
namespace {

using std::chrono::nanoseconds;

constexpr Request kIsHomed = get_user_variable(user_variable::kCalibrated);
constexpr Request kRememberHomed = set_user_variable(user_variable::kCalibrated, 1);
constexpr Request kSetZero = set(drive_parameter("actual_position"), 0);
// Process data follow the mailbox within a few cycles.
constexpr nanoseconds kCounterPatience = std::chrono::milliseconds(100);
// For a joint that is commanded to hold still.
constexpr nanoseconds kRestPatience = std::chrono::seconds(5);

// The counter may wrap in between.
std::int32_t difference(std::int32_t to, std::int32_t from) noexcept {
  return static_cast<std::int32_t>(static_cast<std::uint32_t>(to) - static_cast<std::uint32_t>(from));
}

std::int64_t magnitude(std::int32_t value) noexcept { return std::abs(std::int64_t{value}); }

}  // namespace

bool ContactDetector::update(const DriveInput& input, nanoseconds now, const HomingConfig& config,
                             nanoseconds long_enough) noexcept {
  if (magnitude(input.current_mA) <= config.threshold_mA) {
    pressing_ = false;
    return false;
  }
  // High current in motion is friction or weight, not a stop: start again from here.
  const bool moved = magnitude(difference(input.position_ticks, position_ticks_)) > config.standstill_ticks;
  if (!pressing_ || moved) {
    pressing_ = true;
    position_ticks_ = input.position_ticks;
    since_ = now;
  }
  return now - since_ >= long_enough;
}

ArmHoming::ArmHoming(const HomingConfig& config, nanoseconds cycle) noexcept
    : Sequence(cycle), config_(config) {
  const bool sound = config.speed_rpm > 0 && config.threshold_mA > 0 && config.longest_travel_ticks > 0 &&
                     config.tolerance_ticks > 0 && config.back_off_ticks > 2 * config.tolerance_ticks;
  if (!sound) fail(SequenceFault::kBadTarget);
}

std::optional<DriveOutput> ArmHoming::rest(Progress progress) const noexcept {
  return progress == Progress::kDone ? kNoCurrent : kStopMotor;
}

nanoseconds ArmHoming::time_for(std::int64_t distance_ticks) const noexcept {
  const std::int64_t ticks_per_minute = std::int64_t{config_.speed_rpm} * kTicksPerMotorRevolution;
  return config_.no_motion + 2 * std::chrono::microseconds(distance_ticks * 60'000'000 / ticks_per_minute);
}

void ArmHoming::enter(State state, const DriveInput& input) noexcept {
  state_ = state;
  entry_ticks_ = input.position_ticks;
  advanced_to_ticks_ = 0;
  advanced_at_ = nanoseconds(0);
  settled_ticks_ = input.position_ticks;
  settled_at_ = nanoseconds(0);
  contact_.reset();
  restart_time();
}

// A drive that neither moves nor pushes is not active; waiting for the time limit would not help.
void ArmHoming::await_motion(const DriveInput& input, std::int32_t advance_ticks) noexcept {
  if (advance_ticks < -config_.tolerance_ticks) fail(SequenceFault::kWrongDirection);
  const bool pushing = magnitude(input.current_mA) > config_.threshold_mA;
  if (advance_ticks - advanced_to_ticks_ > config_.standstill_ticks || pushing) {
    advanced_to_ticks_ = advance_ticks;
    advanced_at_ = elapsed();
  } else if (elapsed() - advanced_at_ >= config_.no_motion) {
    fail(SequenceFault::kNotMoving);
  }
}

bool ArmHoming::touches(const DriveInput& input, std::int32_t advance_ticks) noexcept {
  const bool from_rest = advance_ticks < config_.back_off_ticks / 2;
  return contact_.update(input, elapsed(), config_, from_rest ? config_.contact_from_rest : config_.contact);
}

void ArmHoming::settle(const DriveInput& input) noexcept {
  if (magnitude(difference(input.position_ticks, settled_ticks_)) > config_.standstill_ticks) {
    settled_ticks_ = input.position_ticks;
    settled_at_ = elapsed();
  }
  if (elapsed() - settled_at_ >= config_.rest)
    enter(State::kApproach, input);
  else if (elapsed() > kRestPatience)
    fail(SequenceFault::kNotAtRest);
}

void ArmHoming::approach(const DriveInput& input) noexcept {
  travel_ticks_ = difference(input.position_ticks, entry_ticks_);
  if (travel_ticks_ > config_.longest_travel_ticks) fail(SequenceFault::kTravelTooLong);
  if (elapsed() > time_for(config_.longest_travel_ticks)) fail(SequenceFault::kTooSlow);
  if (touches(input, travel_ticks_)) {
    touch_ticks_ = input.position_ticks;
    enter(State::kBackOff, input);
    return;
  }
  await_motion(input, travel_ticks_);
}

void ArmHoming::go_back(const DriveInput& input) noexcept {
  if (difference(touch_ticks_, input.position_ticks) >= config_.back_off_ticks) {
    enter(State::kReturn, input);
  } else if (elapsed() > time_for(config_.back_off_ticks)) {
    fail(SequenceFault::kBlocked);
  }
}

void ArmHoming::come_again(const DriveInput& input) noexcept {
  const std::int32_t advance = difference(input.position_ticks, entry_ticks_);
  const std::int32_t beyond = difference(input.position_ticks, touch_ticks_);
  const bool touched = touches(input, advance);
  const bool late = elapsed() > time_for(config_.back_off_ticks);
  if (touched && magnitude(beyond) <= config_.tolerance_ticks) {
    enter(State::kRelease, input);
  } else if (touched || late || beyond > config_.tolerance_ticks) {
    fail(SequenceFault::kStopNotRepeatable);
  } else {
    await_motion(input, advance);
  }
}

Action ArmHoming::run(const DriveInput& input) noexcept {
  if (const SequenceFault fault = fault_of(input.flags); fault != SequenceFault::kNone) fail(fault);
  if (!input.flags.has(StatusFlag::kInitialized)) fail(SequenceFault::kNotInitialized);

  Action action{kHoldStill, std::nullopt};
  switch (state_) {
    case State::kAsk:
      if (config_.even_if_remembered) {
        enter(State::kSettle, input);
      } else if (const auto homed = ask(kIsHomed, action)) {
        was_homed_ = *homed == 1;
        if (was_homed_) finish();
        enter(State::kSettle, input);
      }
      break;
    case State::kSettle: settle(input); break;
    case State::kApproach:
      action.drive = {ControllerMode::kVelocity, config_.speed_rpm};
      approach(input);
      break;
    case State::kBackOff:
      action.drive = {ControllerMode::kVelocity, -config_.speed_rpm};
      go_back(input);
      break;
    case State::kReturn:
      action.drive = {ControllerMode::kVelocity, config_.speed_rpm};
      come_again(input);
      break;
    case State::kRelease:
      action.drive = kNoCurrent;
      if (elapsed() < config_.release) break;
      if (magnitude(difference(input.position_ticks, entry_ticks_)) > config_.tolerance_ticks) {
        fail(SequenceFault::kMovedAtStop);
      }
      state_ = State::kZero;
      break;
    case State::kZero:
      // The counter may jump before the reply comes.
      action.drive = kNoCurrent;
      if (ask(kSetZero, action)) enter(State::kVerify, input);
      break;
    case State::kVerify:
      action.drive = kNoCurrent;
      if (magnitude(input.position_ticks) <= config_.tolerance_ticks) {
        enter(State::kRemember, input);
      } else if (elapsed() > kCounterPatience) {
        fail(SequenceFault::kMovedAtStop);
      }
      break;
    case State::kRemember:
      action.drive = kNoCurrent;
      if (ask(kRememberHomed, action)) finish();
      break;
  }
  return action;
}

}  // namespace drivers::tmcl
