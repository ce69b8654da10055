/// @file
/// Command and sample of one joint. SI units, gearbox output side, signs as in docs/frames.md.
#pragma once
#include <cmath>
#include <cstdint>
#include <limits>

namespace hal {

/// Base (4) and two arms (5 each): the largest youBot.
inline constexpr int kMaxJoints = 14;
inline constexpr int kMaxGrippers = 2;

enum class CommandMode : std::uint8_t { kTorque, kVelocity, kPosition };

/// The default commands zero torque. A non-finite target refuses the command of the whole robot.
struct JointCommand {
  CommandMode mode = CommandMode::kTorque;
  double target = 0.0;  ///< N·m, rad/s or rad, as `mode` says

  static constexpr JointCommand torque_Nm(double value) noexcept { return {CommandMode::kTorque, value}; }
  static constexpr JointCommand velocity_rad_per_s(double value) noexcept {
    return {CommandMode::kVelocity, value};
  }
  static constexpr JointCommand position_rad(double value) noexcept {
    return {CommandMode::kPosition, value};
  }
};

/// Why a joint does not obey. The first cause is kept until the robot is disabled.
enum class JointFault : std::uint8_t {
  kNone,
  kUndervoltage,
  kOvervoltage,
  kOvertemperature,
  kHallSensor,
  kEncoder,
  kCommandTimeout,  ///< the motor controller's own watchdog on its process data
  kI2t,             ///< thermal model of the winding over its limit
  kNotInitialized,  ///< the motor's commutation is not known, or could not be found
  kEmergencyStop,
  kBadSample,    ///< a measured value is not finite
  kRefused,      ///< the drive refused a request; the backend's report says which
  kNotPrepared,  ///< starting it up failed; the backend's report says where
  kRestarted,    ///< the drive lost its memory while it was in use
  // Found by control::PlausibilityMonitor.
  kEncoderStill,       ///< the position does not change though the motor is driven
  kVelocityDisagrees,  ///< the reported velocity is not the position's rate of change
  kVelocityStep,       ///< the position's rate of change stepped at once
  kTorqueDisagrees,    ///< the measured torque does not follow the command
  kWheelsDisagree,     ///< four wheels cannot roll like that
  kOpposedMotion,      ///< the joint moves on against its torque
  kHallDisagrees,      ///< the motor's Hall sensors do not turn as its encoder counts
};

/// Between which positions a joint may be driven; unlimited by default, as a wheel is.
struct JointRange {
  double lower_rad = -std::numeric_limits<double>::infinity();
  double upper_rad = std::numeric_limits<double>::infinity();

  bool limited() const noexcept { return std::isfinite(lower_rad) || std::isfinite(upper_rad); }
  double width_rad() const noexcept { return upper_rad - lower_rad; }
};

/// The motor's rotor as its Hall sensors show it, beside what the encoder counted. Drives with both have it.
struct RotorReading {
  std::uint32_t number = 0;  ///< of the reading; 0: there is none yet
  double hall_turn = 0.0;    ///< within an electrical revolution, 0 to 1; in sixths or finer
  // Between these the encoder was while the Hall sensors were read, in electrical revolutions. Zero and
  // direction have nothing to do with those of `hall_turn`.
  double encoder_low_turn = 0.0;
  double encoder_high_turn = 0.0;
};

struct JointSample {
  /// Continuous, never wrapped; after a loss of power it goes on from where it was. Homing sets it to zero.
  double position_rad = 0.0;
  double velocity_rad_per_s = 0.0;  ///< as the motor controller reports it: coarse and noisy at low speed
  double torque_Nm = 0.0;  ///< motor current times torque constant and gear ratio; not a torque sensor
  JointFault fault = JointFault::kNone;
  /// position_rad counts as the joint's range does; otherwise from where it was at power-up.
  bool homed = false;
  RotorReading rotor{};  ///< of drives that report it
};

}  // namespace hal
