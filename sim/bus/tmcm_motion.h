/// @file
/// Converts a motion command of a motor controller: profile, limits, and a command to the drive's loops.
#pragma once
#include <chrono>
#include <cstdint>

#include "drivers/tmcl/process_data.h"
#include "sim/bus/board_drive.h"
#include "sim/bus/tmcm_parameters.h"

namespace sim::bus {

/// The board's own counter and velocity, motor side.
struct MotorState {
  std::int32_t position_ticks = 0;
  double velocity_rpm = 0.0;
};

/// Velocity and position follow a trapezoidal ramp (parameters 4, 11, 146); the inner loops are those of
/// sim::Drive. The PID parameters of the board are stored without effect.
/// Cycle: everything.
class TmcmMotion {
 public:
  explicit TmcmMotion(const BoardAxis& axis) noexcept : axis_(axis), units_(axis) {}

  /// One controller period of `command` (modes 0, 1, 2, 5 and 6).
  hal::JointCommand update(const drivers::tmcl::DriveOutput& command, const MotorState& motor,
                           const TmcmParameters& parameters, std::chrono::nanoseconds period) noexcept;

  /// Starts from the actual velocity.
  void restart(const MotorState& motor) noexcept { ramp_rpm_ = motor.velocity_rpm; }
  double ramp_rpm() const noexcept { return ramp_rpm_; }
  double target_rpm() const noexcept { return target_rpm_; }
  double target_mA() const noexcept { return target_mA_; }

 private:
  double position_profile_rpm(std::int32_t error_ticks, const TmcmParameters& parameters) const noexcept;

  BoardAxis axis_;
  MotorUnits units_;
  double ramp_rpm_ = 0.0;
  double target_rpm_ = 0.0;
  double target_mA_ = 0.0;
};

/// Distance with counter wrap: the shorter way.
constexpr std::int32_t ticks_between(std::int32_t from, std::int32_t to) noexcept {
  return static_cast<std::int32_t>(static_cast<std::uint32_t>(to) - static_cast<std::uint32_t>(from));
}

}  // namespace sim::bus
