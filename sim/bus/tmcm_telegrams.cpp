// Telegrams of TmcmBoard, and its mailbox: TMCL without header (official driver; TMCL reference manual).
#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstdlib>
#include <numbers>

#include "sim/bus/tmcm_board.h"

namespace sim::bus {
namespace {

using drivers::tmcl::Command;
using drivers::tmcl::ControllerMode;
using drivers::tmcl::MailboxBytes;
using drivers::tmcl::MoveType;
using drivers::tmcl::Reply;
using drivers::tmcl::Request;
using drivers::tmcl::Status;
using std::chrono::nanoseconds;

constexpr std::uint8_t kHostAddress = 2;  // default of the TMCL manual; not checked

/// Sets are echoed with their value (official driver's acceptance rule); gets carry the answer.
bool answers_with_value(const Request& request) noexcept {
  return request.command == Command::kGetAxisParameter || request.command == Command::kGetGlobalParameter ||
         request.command == Command::kGetFirmwareVersion;
}

std::int32_t saturated(std::int64_t value) noexcept {
  return static_cast<std::int32_t>(std::clamp<std::int64_t>(value, INT32_MIN, INT32_MAX));
}

}  // namespace

bool TmcmBoard::mailbox_received(std::span<const std::uint8_t> message) noexcept {
  if (request_ || reply_) return false;
  const std::optional<Request> request = drivers::tmcl::decode_mailbox_request(message);
  // A missing module does not answer.
  if (!request || (request->module != drivers::tmcl::kDriveModule &&
                   (gripper_ == nullptr || request->module != drivers::tmcl::kGripperModule)))
    return true;
  request_ = request;
  reply_in_ = options_.reply_latency;
  if (request->module == drivers::tmcl::kGripperModule) reply_in_ += options_.gripper_latency;
  return true;
}

void TmcmBoard::serve_mailbox(nanoseconds step) noexcept {
  if (request_ && (reply_in_ -= step).count() <= 0) {
    reply_ =
        request_->module == drivers::tmcl::kGripperModule ? gripper_->execute(*request_) : execute(*request_);
    request_.reset();
  }
  // The previous one may still wait for the master.
  if (reply_ && slave_ != nullptr && slave_->post_mailbox(*reply_)) reply_.reset();
}

MailboxBytes TmcmBoard::execute(const Request& request) noexcept {
  if (drivers::tmcl::asks_for_text(request)) return version_text();
  TmcmParameters::Answer answer = execute_command(request);
  if (!answers_with_value(request)) answer.value = request.value;
  return encode_mailbox(Reply{kHostAddress, request.module, answer.status, request.command, answer.value});
}

TmcmParameters::Answer TmcmBoard::execute_command(const Request& request) noexcept {
  const bool global =
      request.command >= Command::kSetGlobalParameter && request.command <= Command::kRestoreGlobalParameter;
  if (!global && request.command < Command::kStopApplication && request.motor != 0)
    return {Status::kInvalidValue, 0};
  switch (request.command) {
    case Command::kRotateRight: move(ControllerMode::kVelocity, request.value); return {};
    case Command::kRotateLeft:
      move(ControllerMode::kVelocity, saturated(-std::int64_t{request.value}));
      return {};
    case Command::kMotorStop: move(ControllerMode::kMotorStop, 0); return {};
    case Command::kMoveToPosition:
      if (request.type > static_cast<std::uint8_t>(MoveType::kRelative)) return {Status::kWrongType, 0};
      move(ControllerMode::kPosition,
           request.type == static_cast<std::uint8_t>(MoveType::kAbsolute)
               ? request.value
               : static_cast<std::int32_t>(static_cast<std::uint32_t>(motor_.position_ticks) +
                                           static_cast<std::uint32_t>(request.value)));
      return {};
    case Command::kSetAxisParameter: return set_axis_parameter(request.type, request.value);
    case Command::kGetAxisParameter: return get_axis_parameter(request.type);
    case Command::kStoreAxisParameter: return parameters_.store(request.type);
    case Command::kRestoreAxisParameter: return parameters_.restore(request.type);
    case Command::kSetGlobalParameter:
      return parameters_.set_global(request.motor, request.type, request.value);
    case Command::kGetGlobalParameter: return parameters_.get_global(request.motor, request.type);
    case Command::kStoreGlobalParameter: return parameters_.store_global(request.motor, request.type);
    case Command::kRestoreGlobalParameter: return parameters_.restore_global(request.motor, request.type);
    case Command::kGetFirmwareVersion: {  // type 1: number, major and minor version in binary (TMCL manual)
      const int minor = options_.firmware == Firmware::k148 ? 48 : 0;
      const int major = options_.firmware == Firmware::k148 ? 1 : 2;
      return {Status::kOk, options_.controller << 16 | major << 8 | minor};
    }
    default: return {Status::kInvalidCommand, 0};
  }
}

TmcmParameters::Answer TmcmBoard::set_axis_parameter(std::uint8_t number, std::int32_t value) noexcept {
  const TmcmParameters::Answer answer = parameters_.set(number, value);
  if (answer.status != Status::kOk) return answer;
  switch (number) {
    case 0: move(ControllerMode::kPosition, value); break;
    case 1: set_counter(value); break;
    case 2: move(ControllerMode::kVelocity, value); break;
    case 15:
      if (value != 0) {
        if (commutation_.known() || timed_out_) break;
        if (commutation_.turns()) move(ControllerMode::kVelocity, parameters_[241]);
        commutation_.start(motor_.position_ticks);
        stop_when_found_ = commutation_.turns();
      }
      break;
    case 29:
      // The status of a drive's refusal while it cools is not documented.
      if (!i2t_.clear(parameters_[25])) return {Status::kNotAvailable, value};
      break;
    case 154: move(ControllerMode::kPwm, value); break;
    case 155: move(ControllerMode::kCurrent, value); break;
    case 158:
      timed_out_ = false;
      // Fresh process data restart the watchdog; without this, the flag would be set again at once.
      watchdog_armed_ = false;
      break;
    default: break;
  }
  return answer;
}

TmcmParameters::Answer TmcmBoard::get_axis_parameter(std::uint8_t number) const noexcept {
  TmcmParameters::Answer answer = parameters_.get(number);
  if (answer.status != Status::kOk) return answer;
  const auto target_ticks =
      command_.mode == ControllerMode::kPosition ? command_.value : motor_.position_ticks;
  const auto rounded = [](double value) { return static_cast<std::int32_t>(std::lround(value)); };
  switch (number) {
    case 0: answer.value = target_ticks; break;
    case 1: answer.value = input_.position_ticks; break;
    case 2: answer.value = rounded(motion_.target_rpm()); break;
    case 3: answer.value = input_.velocity_rpm; break;
    case 13: answer.value = rounded(motion_.ramp_rpm()); break;
    case 15: answer.value = commutation_.known() ? 1 : 0; break;
    case 27: answer.value = saturated(std::llround(i2t_.sum_A2_ms())); break;
    case 150: answer.value = input_.current_mA; break;
    case 151:
      answer.value = undervoltage_ ? 1700 : overvoltage_ ? 3000 : rounded(100 * options_.axis.supply_V);
      break;
    case 152: answer.value = overtemperature_ ? 3000 : 1000; break;  // 1000 is about 35 °C (official driver)
    case 153: answer.value = pwm(); break;
    case 155: answer.value = rounded(motion_.target_mA()); break;
    case 156: answer.value = static_cast<std::int32_t>(input_.flags.raw()); break;
    case 157: answer.value = rounded(std::abs(current_mA_ * pwm() / 1799)); break;
    case 160: answer.value = commutation_.searching() ? 1 : 0; break;
    case 200: answer.value = rounded(motion_.target_mA() == 0 ? 0 : motion_.target_mA() - current_mA_); break;
    case 209: answer.value = input_.position_ticks; break;
    case 210: answer.value = hall_angle_; break;
    case 226: answer.value = ticks_between(motor_.position_ticks, target_ticks); break;
    case 228: answer.value = rounded(motion_.ramp_rpm() - motor_.velocity_rpm); break;
    default: break;
  }
  return answer;
}

/// V = R·I + k_e·ω as a share of the supply.
std::int32_t TmcmBoard::pwm() const noexcept {
  const BoardAxis& axis = options_.axis;
  const double voltage_V = axis.winding_resistance_ohm * current_mA_ / 1000 +
                           axis.torque_constant_Nm_per_A * motor_.velocity_rpm * 2 * std::numbers::pi / 60;
  return static_cast<std::int32_t>(std::lround(1799 * std::clamp(voltage_V / axis.supply_V, -1.0, 1.0)));
}

/// Exactly eight characters: "1610V148", "174V1.48" (fact sheet; the real format is not verified).
MailboxBytes TmcmBoard::version_text() noexcept {
  MailboxBytes text{};
  if (zero_versions_left_ > 0) {
    --zero_versions_left_;
    return text;
  }
  char* const begin = reinterpret_cast<char*>(text.data());
  char* const end = std::to_chars(begin, begin + text.size(), options_.controller).ptr;
  const bool old = options_.firmware == Firmware::k148;
  const char* version = end - begin > 3 ? (old ? "V148" : "V200") : (old ? "V1.48" : "V2.00");
  for (char* out = end; *version != '\0' && out < begin + text.size();) *out++ = *version++;
  return text;
}

}  // namespace sim::bus
