#include "sim/bus/tmcm_board.h"

#include <cmath>
#include <cstdlib>

namespace sim::bus {
namespace {

using drivers::tmcl::ControllerMode;
using drivers::tmcl::CurrentSign;
using drivers::tmcl::StatusFlag;
using std::chrono::nanoseconds;

/// "Halted" and "position reached" use the velocity without the quantisation noise of 1 ms.
constexpr double kSmoothing = 0.05;  // per period: 20 ms
/// Above parameter 6, so that a drive at its limit does not report overcurrent.
constexpr double kOvercurrentMargin = 1.1;
/// The encoder's spurious jumps have various sizes; a quarter turn of the motor is a harmful one.
constexpr std::uint32_t kGlitchPeriod = 97;
constexpr std::int32_t kGlitchTicks = 1000;

std::int32_t wrapped(std::int64_t ticks) noexcept {
  return static_cast<std::int32_t>(static_cast<std::uint32_t>(static_cast<std::uint64_t>(ticks)));
}

constexpr std::uint32_t bit(StatusFlag flag, bool set) noexcept {
  return set ? 1U << static_cast<unsigned>(flag) : 0U;
}

}  // namespace

TmcmBoard::TmcmBoard(EmulatedSlave& slave, BoardDrive& drive, const TmcmOptions& options)
    : TmcmBoard(&slave, drive, options) {
  slave.attach(*this);
}

TmcmBoard::TmcmBoard(BoardDrive& drive, const TmcmOptions& options) : TmcmBoard(nullptr, drive, options) {}

TmcmBoard::TmcmBoard(EmulatedSlave* slave, BoardDrive& drive, const TmcmOptions& options)
    : slave_(slave),
      drive_(drive),
      options_(options),
      units_(options.axis),
      parameters_(options.firmware, options.axis, options.password),
      commutation_(options.firmware, options.commutation_time, options.axis.ticks_per_electrical_rev()),
      motion_(options.axis),
      zero_versions_left_(options.zero_version_replies) {
  power_changed(true);
}

// ---- power, state, process data ----

void TmcmBoard::power_changed(bool on) noexcept {
  powered_ = on;
  parameters_.power_up();
  commutation_.forget();
  i2t_.reset();
  command_ = {};
  last_mode_ = ControllerMode::kMotorStop;
  watchdog_armed_ = timed_out_ = stop_when_found_ = false;
  since_tick_ = since_outputs_ = {};
  request_.reset();
  reply_.reset();
  zero_versions_left_ = options_.zero_version_replies;
  drive_.command({}, false);
  followed_.reset();
  if (gripper_ != nullptr) gripper_->power_changed(on);
  // An incremental encoder: zero is the joint's position at power-up.
  encoder_ticks_ = units_.ticks(drive_.measured().position_rad);
  set_counter(0);
  motor_.velocity_rpm = smooth_rpm_ = current_mA_ = 0.0;
  motion_.restart(motor_);
  publish();
}

void TmcmBoard::state_changed(drivers::ethercat::AlState state) noexcept {
  if (state != drivers::ethercat::AlState::kInit) return;
  request_.reset();
  reply_.reset();
}

void TmcmBoard::outputs_changed(std::span<const std::uint8_t> outputs) noexcept {
  drivers::tmcl::DriveOutput output;
  if (!unpack(outputs, output)) return;
  watchdog_armed_ = true;
  since_outputs_ = {};
  const bool new_mode = output.mode != last_mode_;
  last_mode_ = output.mode;
  switch (output.mode) {
    case ControllerMode::kNoMoreAction: break;
    case ControllerMode::kSetPositionToReference:
      set_counter(output.value);
      move(ControllerMode::kMotorStop, 0);
      break;
    case ControllerMode::kInitialize:
      move(ControllerMode::kMotorStop, 0);
      // Once per command: a failure stays until the master tries again.
      if (new_mode && !commutation_.turns()) commutation_.start(motor_.position_ticks);
      break;
    default: move(output.mode, output.value);
  }
}

void TmcmBoard::inputs(std::span<std::uint8_t> inputs) noexcept { pack(options_.firmware, input_, inputs); }

void TmcmBoard::fault(BoardFault fault, bool present) noexcept {
  switch (fault) {
    case BoardFault::kStuckEncoder: stuck_encoder_ = present; break;
    case BoardFault::kHallSensor: hall_error_ = present; break;
    case BoardFault::kUndervoltage: undervoltage_ = present; break;
    case BoardFault::kOvervoltage: overvoltage_ = present; break;
    case BoardFault::kOvertemperature: overtemperature_ = present; break;
    default: break;
  }
}

void TmcmBoard::move(ControllerMode mode, std::int32_t value) noexcept {
  if (mode > ControllerMode::kInitialize) return;  // unknown: ignored
  const bool begins_to_turn =
      mode == ControllerMode::kVelocity && value != 0 && (command_.mode != mode || command_.value == 0);
  command_ = {mode, value};
  stop_when_found_ = false;
  if (!commutation_.turns() || commutation_.known()) return;
  if (mode != ControllerMode::kVelocity || value == 0) {
    commutation_.give_up();
  } else if (!timed_out_ && (begins_to_turn || !commutation_.failed())) {
    commutation_.start(motor_.position_ticks);
  }
}

void TmcmBoard::set_counter(std::int32_t ticks) noexcept {
  counter_offset_ = ticks - encoder_ticks_;
  motor_.position_ticks = ticks;
}

// ---- the controller period ----

void TmcmBoard::advance(nanoseconds step) noexcept {
  if (gripper_ != nullptr) gripper_->advance(step);
  since_tick_ += step;
  for (; since_tick_ >= kPeriod; since_tick_ -= kPeriod) tick();
  serve_mailbox(step);
}

void TmcmBoard::tick() noexcept {
  ++ticks_done_;
  read_sensors();
  commutation_.update(motor_.position_ticks, !hall_error_, kPeriod);
  if (stop_when_found_ && !commutation_.searching()) move(ControllerMode::kMotorStop, 0);
  watch();
  drive_motor();
  publish();
}

void TmcmBoard::read_sensors() noexcept {
  const hal::JointSample sample = drive_.measured();
  const std::int64_t before = encoder_ticks_;
  encoder_ticks_ = units_.ticks(sample.position_rad);
  if (!hall_error_) hall_angle_ = hall_angle();
  if (stuck_encoder_) counter_offset_ -= encoder_ticks_ - before;  // these counts are lost for good
  motor_.position_ticks = wrapped(encoder_ticks_ + counter_offset_);
  if (glitches_ && ticks_done_ % kGlitchPeriod == 0)
    motor_.position_ticks = wrapped(std::int64_t{motor_.position_ticks} + kGlitchTicks);
  motor_.velocity_rpm = stuck_encoder_ ? 0.0 : units_.rpm(sample.velocity_rad_per_s);
  smooth_rpm_ += kSmoothing * (motor_.velocity_rpm - smooth_rpm_);
  current_mA_ = units_.current_mA(sample.torque_Nm);
}

/// Three Hall sensors 120° apart distinguish six sectors of an electrical revolution; the angle is the middle
/// of a sector, 65536 per revolution (TMCL manuals of Trinamic's BLDC modules, parameter 210). They are on
/// the motor: their zero is unrelated to that of the encoder's counter.
std::int32_t TmcmBoard::hall_angle() const noexcept {
  constexpr std::int64_t kSectors = 6;
  constexpr std::int64_t kMounted = 137;  // encoder counts from the simulation's zero to a sector's edge
  const std::int64_t revolution = options_.axis.ticks_per_electrical_rev();
  const std::int64_t within = ((encoder_ticks_ + kMounted) % revolution + revolution) % revolution;
  const std::int64_t sector = kSectors * within / revolution;
  return static_cast<std::int32_t>((2 * sector + 1) * 0x10000 / (2 * kSectors) - 0x8000);
}

void TmcmBoard::watch() noexcept {
  const std::int32_t seconds_before = i2t_.seconds_exceeded();
  i2t_.update(current_mA_ / 1000, parameters_[25], parameters_[26], kPeriod);
  parameters_.assign(28, parameters_[28] + i2t_.seconds_exceeded() - seconds_before);

  since_outputs_ += kPeriod;
  if (watchdog_armed_ && !timed_out_ && since_outputs_ > std::chrono::milliseconds(parameters_[90])) {
    timed_out_ = true;
    hold_ticks_ = motor_.position_ticks;
    move(ControllerMode::kMotorStop, 0);  // the old command must not return when the flag is cleared
  }
}

bool TmcmBoard::bridge_enabled() const noexcept {
  if (!powered_ || undervoltage_ || overtemperature_ || (overvoltage_ && parameters_[245] != 0)) return false;
  return commutation_.known() || (commutation_.turns() && commutation_.searching());
}

void TmcmBoard::drive_motor() noexcept {
  drivers::tmcl::DriveOutput command = command_;
  if (timed_out_) command = {ControllerMode::kPosition, hold_ticks_};
  if (i2t_.exceeded()) command = {ControllerMode::kPwm, 0};
  const bool enabled = bridge_enabled();
  followed_ = enabled ? std::optional(command) : std::nullopt;
  if (!enabled) motion_.restart(motor_);
  drive_.command(motion_.update(command, motor_, parameters_, kPeriod), enabled);
}

// ---- reported values ----

bool TmcmBoard::position_reached() const noexcept {
  return command_.mode == ControllerMode::kPosition && commutation_.known() &&
         std::abs(std::int64_t{ticks_between(motor_.position_ticks, command_.value)}) <= parameters_[10] &&
         std::abs(smooth_rpm_) <= parameters_[7];
}

std::uint32_t TmcmBoard::flags() const noexcept {
  const bool old = options_.firmware == Firmware::k148;
  return bit(StatusFlag::kOvercurrent, std::abs(current_mA_) > kOvercurrentMargin * parameters_[6]) |
         bit(StatusFlag::kUndervoltage, undervoltage_) | bit(StatusFlag::kOvervoltage, overvoltage_) |
         bit(StatusFlag::kOvertemperature, overtemperature_) |
         bit(StatusFlag::kMotorHalted, std::abs(smooth_rpm_) <= parameters_[9]) |
         bit(StatusFlag::kHallSensorError, hall_error_) |
         bit(StatusFlag::kInitializationError, commutation_.failed()) |
         bit(StatusFlag::kPwmMode, old && command_.mode == ControllerMode::kPwm) |
         bit(StatusFlag::kVelocityMode, command_.mode == ControllerMode::kVelocity) |
         bit(StatusFlag::kPositionMode, command_.mode == ControllerMode::kPosition) |
         bit(StatusFlag::kCurrentMode, command_.mode == ControllerMode::kCurrent) |
         bit(StatusFlag::kPositionReached, position_reached()) |
         bit(StatusFlag::kInitialized, commutation_.known()) | bit(StatusFlag::kTimeout, timed_out_) |
         bit(StatusFlag::kI2tExceeded, i2t_.exceeded());
}

void TmcmBoard::publish() noexcept {
  const auto rounded = [](double value) { return static_cast<std::int32_t>(std::lround(value)); };
  input_.position_ticks = motor_.position_ticks;
  input_.current_mA =
      rounded(options_.current_sign == CurrentSign::kAbsolute ? std::abs(current_mA_) : current_mA_);
  input_.velocity_rpm = rounded(motor_.velocity_rpm);
  input_.flags = drivers::tmcl::StatusFlags(flags());
  if (options_.firmware == Firmware::k148) {
    input_.pwm = pwm();
  } else {
    input_.targets = {command_.mode == ControllerMode::kPosition ? command_.value : motor_.position_ticks,
                      rounded(motion_.target_mA()), rounded(motion_.target_rpm()),
                      rounded(motion_.ramp_rpm())};
  }
}

}  // namespace sim::bus
