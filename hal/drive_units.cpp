#include "hal/drive_units.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "drivers/tmcl/process_data.h"
#include "drivers/tmcl/status_flags.h"

namespace hal {

namespace tmcl = drivers::tmcl;

JointFault joint_fault_of(tmcl::StatusFlags flags) noexcept {
  using tmcl::StatusFlag;
  constexpr std::array<std::pair<StatusFlag, JointFault>, 9> kFaults{{
      {StatusFlag::kTimeout, JointFault::kCommandTimeout},
      {StatusFlag::kI2tExceeded, JointFault::kI2t},
      {StatusFlag::kUndervoltage, JointFault::kUndervoltage},
      {StatusFlag::kOvervoltage, JointFault::kOvervoltage},
      {StatusFlag::kOvertemperature, JointFault::kOvertemperature},
      {StatusFlag::kHallSensorError, JointFault::kHallSensor},
      {StatusFlag::kEncoderError, JointFault::kEncoder},
      {StatusFlag::kInitializationError, JointFault::kNotInitialized},
      {StatusFlag::kEmergencyStop, JointFault::kEmergencyStop},
  }};
  for (const auto& [flag, fault] : kFaults)
    if (flags.has(flag)) return fault;
  return JointFault::kNone;
}

DriveUnits::DriveUnits(const AxisData& axis, bool unsigned_current)
    : scale_(axis.constants),
      current_limit_mA_(static_cast<std::int32_t>(1000 * axis.current_limit_A)),
      speed_limit_rad_per_s_(axis.speed_limit_rad_per_s),
      unsigned_current_(unsigned_current) {}

tmcl::DriveOutput DriveUnits::output(const JointCommand& command, const tmcl::DriveInput& input,
                                     std::int64_t position_ticks) const noexcept {
  switch (command.mode) {
    case CommandMode::kTorque:
      return {tmcl::ControllerMode::kCurrent,
              std::clamp(scale_.motor_current_mA(command.target), -current_limit_mA_, current_limit_mA_)};
    case CommandMode::kVelocity:
      return {tmcl::ControllerMode::kVelocity,
              scale_.motor_rpm(std::clamp(command.target, -speed_limit_rad_per_s_, speed_limit_rad_per_s_))};
    case CommandMode::kPosition: {
      // The drive counts modulo 2^32: the remaining distance is the same in its counter and in ours.
      const double distance_ticks =
          command.target / scale_.position_rad(1) - static_cast<double>(position_ticks);
      const auto distance = static_cast<std::int64_t>(std::llround(std::clamp(distance_ticks, -2e9, 2e9)));
      return {tmcl::ControllerMode::kPosition,
              static_cast<std::int32_t>(static_cast<std::uint32_t>(input.position_ticks) +
                                        static_cast<std::uint32_t>(distance))};
    }
  }
  return {tmcl::ControllerMode::kMotorStop, 0};
}

JointSample DriveUnits::sample(const tmcl::DriveInput& input, const tmcl::DriveOutput& commanded,
                               std::int64_t position_ticks) const noexcept {
  JointSample sample;
  // The unwrapped counter exceeds int32 after days of driving in one direction; the scale is linear.
  sample.position_rad = static_cast<double>(position_ticks) * scale_.position_rad(1);
  sample.velocity_rad_per_s = scale_.velocity_rad_per_s(input.velocity_rpm);
  const auto sign = unsigned_current_ ? tmcl::CurrentSign::kAbsolute : tmcl::CurrentSign::kSigned;
  sample.torque_Nm = scale_.torque_Nm(tmcl::signed_current_mA(sign, input, commanded));
  sample.fault = joint_fault_of(input.flags);
  return sample;
}

}  // namespace hal
