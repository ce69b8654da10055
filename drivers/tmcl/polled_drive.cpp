#include "drivers/tmcl/polled_drive.h"

#include <algorithm>
#include <array>

#include "drivers/tmcl/axis_parameters.h"

namespace drivers::tmcl {
namespace {

using enum DriveReading;

constexpr std::array kFewTurns{kPosition, kCurrent, kPosition, kVelocity, kPosition, kCurrent,
                               kPosition, kStatus,  kPosition, kCurrent,  kPosition, kVelocity,
                               kPosition, kCurrent, kPosition, kMark};
constexpr std::array kThreeAtATime{kPosition, kCurrent, kVelocity, kPosition, kCurrent, kStatus,
                                   kPosition, kCurrent, kVelocity, kPosition, kCurrent, kMark};
constexpr std::array kFourAtATime{kPosition, kCurrent, kVelocity, kStatus,
                                  kPosition, kCurrent, kVelocity, kMark};

std::span<const DriveReading> turns_for(int requests) noexcept {
  if (requests == 4) return kThreeAtATime;
  if (requests == 5) return kFourAtATime;
  return kFewTurns;
}

Request request_for(DriveReading reading, const PolledDriveOptions& options) noexcept {
  switch (reading) {
    case kPosition: return get(drive_parameter("actual_position"), options.motor);
    case kCurrent: return get(drive_parameter("actual_motor_current"), options.motor);
    case kVelocity: return get(drive_parameter("actual_speed"), options.motor);
    case kStatus: return get(drive_parameter("error_and_status"), options.motor);
    case kMark: return get_user_variable(options.mark_variable);
  }
  return {};
}

Request to_motor(Request request, std::uint8_t motor) noexcept {
  request.motor = motor;
  return request;
}

}  // namespace

std::optional<Request> request_for(const DriveOutput& output, std::uint8_t motor) noexcept {
  constexpr Request kStop{kDriveModule, Command::kMotorStop, 0, 0, 0};
  switch (output.mode) {
    case ControllerMode::kMotorStop: return to_motor(kStop, motor);
    case ControllerMode::kPosition: return set(drive_parameter("target_position"), output.value, motor);
    case ControllerMode::kVelocity: return set(drive_parameter("target_speed"), output.value, motor);
    case ControllerMode::kNoMoreAction: return std::nullopt;
    case ControllerMode::kSetPositionToReference:
      return set(drive_parameter("actual_position"), output.value, motor);
    case ControllerMode::kPwm: return set(drive_parameter("target_pwm"), output.value, motor);
    case ControllerMode::kCurrent: return set(drive_parameter("target_current"), output.value, motor);
    case ControllerMode::kInitialize: return set(drive_parameter("initialize_joint"), 1, motor);
  }
  return std::nullopt;
}

PolledDrive::PolledDrive(Transport& transport, const PolledDriveOptions& options) noexcept
    : transport_(transport),
      options_(options),
      batch_(options.patience_cycles),
      turns_(turns_for(options.requests_per_cycle)) {}

bool PolledDrive::receive() noexcept {
  answer_.reset();
  refusal_.reset();
  fresh_ = restarted_ = false;
  batch_.step(transport_);
  if (batch_.lost() != lost_seen_) {
    lost_seen_ = batch_.lost();
    check_mark_ = true;
    last_sent_.reset();
  }
  const std::span<const Completion> done = batch_.take();
  for (const Completion& completion : done) take_in(completion);
  return !done.empty();
}

void PolledDrive::take_in(const Completion& done) noexcept {
  const Request& request = done.request;
  if (asked_ && request == *asked_) {
    answer_ = done;
    asked_.reset();
    return;
  }
  if (!done.done()) {
    refusal_ = done;
    return;
  }
  const std::int32_t value = done.reply.value;
  if (request == request_for(kMark, options_)) {
    restarted_ = marked_ && value != kMemoryMark;
    marked_ = value == kMemoryMark;
  } else if (request == set_user_variable(options_.mark_variable, kMemoryMark)) {
    marked_ = true;
  } else if (request == request_for(kPosition, options_)) {
    input_.position_ticks = value;
    stamp_ = asked_at_;
    position_age_ = done.reply_age;
    fresh_ = true;
  } else if (request == request_for(kCurrent, options_)) {
    input_.current_mA = value;
  } else if (request == request_for(kVelocity, options_)) {
    input_.velocity_rpm = value;
  } else if (request == request_for(kStatus, options_)) {
    input_.flags = StatusFlags(static_cast<std::uint32_t>(value));
  }
}

void PolledDrive::send(const DriveOutput& output, std::chrono::nanoseconds now) noexcept {
  if (!batch_.free()) return;
  asked_at_ = now;
  const bool one_by_one = options_.requests_per_cycle == 1;
  if (!one_by_one || command_turn_) {
    // A second command might restart the commutation; all others may be repeated.
    const bool once = output.mode == ControllerMode::kInitialize && last_sent_ == output;
    const std::optional<Request> command = once ? std::nullopt : request_for(output, options_.motor);
    if (command && !batch_.post(transport_, *command)) return;
    last_sent_ = output;
    command_turn_ = false;
    if (one_by_one && command) return;
  }
  command_turn_ = true;
  const int reads = std::max(options_.requests_per_cycle - 1, 1);
  // With several reads per cycle, what takes the place of one also takes its turn: otherwise the next cycles
  // would begin with another reading, and the position would lose its place.
  turn_ -= turn_ % static_cast<std::size_t>(reads);
  for (int i = 0; i < reads; ++i) {
    const bool last = i == reads - 1;
    const DriveReading reading = turns_[turn_];
    const bool spare = reads == 1 || reads == kMaxRequests - 1 || reading == kCurrent || reading == kVelocity;
    bool in_turn = false;
    Request request;
    if (last && check_mark_) {
      request = request_for(kMark, options_);
    } else if (last && !marked_) {
      request = set_user_variable(options_.mark_variable, kMemoryMark);
    } else if (last && spare && asked_) {
      request = *asked_;
    } else {
      request = request_for(reading, options_);
      in_turn = true;
    }
    if (in_turn || reads > 1) turn_ = (turn_ + 1) % turns_.size();
    if (!batch_.post(transport_, request)) return;
    if (last) check_mark_ = false;
  }
}

void PolledDrive::stop() noexcept {
  last_sent_.reset();
  (void)batch_.post(transport_, *request_for({ControllerMode::kMotorStop, 0}, options_.motor));
}

}  // namespace drivers::tmcl
