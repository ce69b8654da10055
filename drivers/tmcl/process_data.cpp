#include "drivers/tmcl/process_data.h"

#include <algorithm>
#include <cstdlib>

namespace drivers::tmcl {
namespace {

std::int32_t load(std::span<const std::uint8_t> pdo, std::size_t offset) noexcept {
  std::uint32_t bits = 0;
  for (std::size_t i = 0; i < 4; ++i) bits |= std::uint32_t{pdo[offset + i]} << (8 * i);
  return static_cast<std::int32_t>(bits);
}

void store(std::span<std::uint8_t> pdo, std::size_t offset, std::int32_t value) noexcept {
  const auto bits = static_cast<std::uint32_t>(value);
  for (std::size_t i = 0; i < 4; ++i) pdo[offset + i] = static_cast<std::uint8_t>(bits >> (8 * i));
}

}  // namespace

const char* name(ControllerMode mode) noexcept {
  switch (mode) {
    case ControllerMode::kMotorStop: return "motor stop";
    case ControllerMode::kPosition: return "position";
    case ControllerMode::kVelocity: return "velocity";
    case ControllerMode::kNoMoreAction: return "no more action";
    case ControllerMode::kSetPositionToReference: return "set position to reference";
    case ControllerMode::kPwm: return "PWM";
    case ControllerMode::kCurrent: return "current";
    case ControllerMode::kInitialize: return "initialise";
  }
  return "unknown mode";
}

bool pack(const DriveOutput& output, std::span<std::uint8_t> pdo) noexcept {
  if (pdo.size() < kOutputBytes) return false;
  std::fill(pdo.begin(), pdo.end(), std::uint8_t{0});
  store(pdo, 0, output.value);
  pdo[4] = static_cast<std::uint8_t>(output.mode);
  return true;
}

bool unpack(std::span<const std::uint8_t> pdo, DriveOutput& output) noexcept {
  if (pdo.size() < kOutputBytes) return false;
  output = {static_cast<ControllerMode>(pdo[4]), load(pdo, 0)};
  return true;
}

bool unpack(Firmware firmware, std::span<const std::uint8_t> pdo, DriveInput& input) noexcept {
  if (pdo.size() < input_bytes(firmware)) return false;
  input = {};
  input.position_ticks = load(pdo, 0);
  input.current_mA = load(pdo, 4);
  input.velocity_rpm = load(pdo, 8);
  input.flags = StatusFlags(static_cast<std::uint32_t>(load(pdo, 12)));
  if (firmware == Firmware::k148) {
    input.pwm = load(pdo, 16);
  } else {
    input.targets = {load(pdo, 16), load(pdo, 20), load(pdo, 24), load(pdo, 28)};
  }
  return true;
}

bool pack(Firmware firmware, const DriveInput& input, std::span<std::uint8_t> pdo) noexcept {
  if (pdo.size() < input_bytes(firmware)) return false;
  std::fill(pdo.begin(), pdo.end(), std::uint8_t{0});
  store(pdo, 0, input.position_ticks);
  store(pdo, 4, input.current_mA);
  store(pdo, 8, input.velocity_rpm);
  store(pdo, 12, static_cast<std::int32_t>(input.flags.raw()));
  if (firmware == Firmware::k148) {
    store(pdo, 16, input.pwm.value_or(0));
  } else {
    const DriveTargets targets = input.targets.value_or(DriveTargets{});
    store(pdo, 16, targets.position_ticks);
    store(pdo, 20, targets.current_mA);
    store(pdo, 24, targets.velocity_rpm);
    store(pdo, 28, targets.ramp_velocity_rpm);
  }
  return true;
}

std::int32_t signed_current_mA(CurrentSign sign, const DriveInput& input,
                               const DriveOutput& commanded) noexcept {
  if (sign == CurrentSign::kSigned) return input.current_mA;
  std::int32_t direction = input.velocity_rpm;
  if (input.targets && input.targets->current_mA != 0) {
    direction = input.targets->current_mA;
  } else if (commanded.mode == ControllerMode::kCurrent && commanded.value != 0) {
    direction = commanded.value;
  }
  // Through 64 bits: the magnitude of INT32_MIN does not fit.
  const std::int64_t magnitude = std::min<std::int64_t>(std::abs(std::int64_t{input.current_mA}), INT32_MAX);
  return static_cast<std::int32_t>(direction < 0 ? -magnitude : magnitude);
}

}  // namespace drivers::tmcl
