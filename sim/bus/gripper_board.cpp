#include "sim/bus/gripper_board.h"

#include <algorithm>
#include <cmath>

#include "drivers/tmcl/axis_parameters.h"

namespace sim::bus {
namespace {

using drivers::tmcl::Command;
using drivers::tmcl::find_gripper_parameter;
using drivers::tmcl::kUserVariableBank;
using drivers::tmcl::MailboxBytes;
using drivers::tmcl::MoveType;
using drivers::tmcl::Request;
using drivers::tmcl::Status;

constexpr std::uint8_t kHostAddress = 2;
constexpr std::uint32_t kStallGuard = 1U << 0, kStandstill = 1U << 7;  // parameter 208

struct DefaultSetting {
  std::uint8_t number;
  std::int32_t value;
};
// Threshold and filter: configuration of the official driver. Speed: the whole travel in about 2 s, because
// that driver allows 4 s per motion; the rest is also an assumption.
constexpr DefaultSetting kDefaults[] = {{4, 1000}, {5, 1000}, {6, 128},  {7, 8},   {140, 8},
                                        {154, 3},  {173, 1},  {174, 50}, {171, 1}, {214, 200}};

double microsteps_per_s(std::int32_t speed, std::int32_t pulse_divisor) noexcept {
  return 16e6 * speed / (std::exp2(pulse_divisor) * 2048 * 32);
}

}  // namespace

GripperBoard::GripperBoard(const GripperOptions& options) noexcept : options_(options) {
  for (std::size_t i = 0; i < bars_.size(); ++i) bars_[i].opening = options_.opening[i];
  forget();
}

void GripperBoard::forget() noexcept {
  for (Bar& bar : bars_) {
    bar = {.parameters = {}, .opening = bar.opening};
    for (const DefaultSetting& setting : kDefaults) bar.parameters[setting.number] = setting.value;
  }
  user_variables_ = {};
}

void GripperBoard::power_changed(bool on) noexcept {
  powered_ = on;
  forget();
}

void GripperBoard::advance(std::chrono::nanoseconds step) noexcept {
  if (!powered_) return;
  for (Bar& bar : bars_) advance(bar, std::chrono::duration<double>(step).count());
}

void GripperBoard::advance(Bar& bar, double seconds) const noexcept {
  const double most = seconds * microsteps_per_s(bar.speed, bar.parameters[154]);
  const double move = std::clamp(bar.target - bar.counter, -most, most);
  bar.counter += move;
  const double wanted = bar.opening - move;
  // An object narrower than the present opening does not push the bars apart.
  bar.opening = std::clamp(wanted, std::min(object_opening_, bar.opening), options_.travel);
  bar.stalled = bar.opening != wanted;
}

MailboxBytes GripperBoard::execute(const Request& request) noexcept {
  if (drivers::tmcl::asks_for_text(request)) {
    // A comment in the official driver cites "KR842V20"; the first byte is assumed to be the host's address.
    return {kHostAddress, '8', '4', '2', 'V', '2', '.', '0'};
  }
  const Answer answer = execute_command(request);
  return encode_mailbox(
      drivers::tmcl::Reply{kHostAddress, request.module, answer.status, request.command, answer.value});
}

GripperBoard::Answer GripperBoard::execute_command(const Request& request) noexcept {
  switch (request.command) {
    case Command::kSetGlobalParameter:
      if (request.motor != kUserVariableBank) return {Status::kInvalidValue, request.value};
      user_variables_[request.type] = request.value;
      return {Status::kOk, request.value};
    case Command::kGetGlobalParameter:
      if (request.motor != kUserVariableBank) return {Status::kInvalidValue, 0};
      return {Status::kOk, user_variables_[request.type]};
    case Command::kGetFirmwareVersion: return {Status::kOk, 842 << 16 | 2 << 8};
    default:
      if (request.motor >= bars_.size()) return {Status::kInvalidValue, request.value};
      return execute_on_bar(request, bars_[request.motor]);
  }
}

GripperBoard::Answer GripperBoard::execute_on_bar(const Request& request, Bar& bar) noexcept {
  const Answer done{Status::kOk, request.value};
  const auto here = static_cast<std::int32_t>(std::lround(bar.counter));
  const auto turn = [&bar](std::int32_t direction, std::int32_t speed) {
    bar.speed = std::clamp(speed, 0, 2047);
    bar.target = direction > 0 ? INT32_MAX : INT32_MIN;
  };
  switch (request.command) {
    case Command::kRotateRight: turn(1, request.value); return done;
    case Command::kRotateLeft: turn(-1, request.value); return done;
    case Command::kMotorStop:
      bar.target = here;
      bar.counter = here;
      return done;
    case Command::kMoveToPosition: {
      if (request.type > static_cast<std::uint8_t>(MoveType::kRelative))
        return {Status::kWrongType, request.value};
      const std::int64_t from = request.type == static_cast<std::uint8_t>(MoveType::kRelative) ? here : 0;
      bar.target =
          static_cast<std::int32_t>(std::clamp<std::int64_t>(from + request.value, INT32_MIN, INT32_MAX));
      bar.speed = bar.parameters[4];
      return done;
    }
    case Command::kSetAxisParameter: return set(bar, request.type, request.value);
    case Command::kGetAxisParameter: return get(bar, request.type);
    default: return {Status::kInvalidCommand, request.value};
  }
}

GripperBoard::Answer GripperBoard::get(const Bar& bar, std::uint8_t number) noexcept {
  const auto* const row = find_gripper_parameter(number);
  if (row == nullptr || !readable(row->access)) return {Status::kWrongType, 0};
  switch (number) {
    case 0: return {Status::kOk, bar.target};
    case 1: return {Status::kOk, static_cast<std::int32_t>(std::lround(bar.counter))};
    case 3: return {Status::kOk, !bar.moving() ? 0 : bar.target > bar.counter ? bar.speed : -bar.speed};
    case 8: return {Status::kOk, bar.moving() ? 0 : 1};
    case 206: return {Status::kOk, bar.stalled ? 0 : 1023};
    case 208:
      return {Status::kOk, static_cast<std::int32_t>((bar.stalled ? kStallGuard : 0U) |
                                                     (bar.moving() ? 0U : kStandstill))};
    default: return {Status::kOk, bar.parameters[number]};
  }
}

GripperBoard::Answer GripperBoard::set(Bar& bar, std::uint8_t number, std::int32_t value) noexcept {
  const auto* const row = find_gripper_parameter(number);
  if (row == nullptr || !writable(row->access)) return {Status::kWrongType, value};
  if (!row->in_range(value)) return {Status::kInvalidValue, value};
  bar.parameters[number] = value;
  if (number == 0) {
    bar.target = value;
    bar.speed = bar.parameters[4];
  }
  if (number == 1) {
    bar.counter = value;
    bar.target = value;
  }
  return {Status::kOk, value};
}

}  // namespace sim::bus
