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

/// The default commands zero torque. A non-finite target invalidates the command of the whole robot.
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
  kNotInitialized,  ///< the motor's commutation is unknown or could not be found
  kEmergencyStop,
  kBadSample,    ///< a measured value is not finite
  kRefused,      ///< the drive refused a request; the backend's report names it
  kNotPrepared,  ///< start-up failed; the backend's report names the step
  kRestarted,    ///< the drive lost its memory during operation
  // Detected by control::PlausibilityMonitor.
  kEncoderStill,       ///< the position does not change although the motor is driven
  kVelocityDisagrees,  ///< the reported velocity is not the position's rate of change
  kVelocityStep,       ///< the position's rate of change has a step
  kTorqueDisagrees,    ///< the measured torque does not follow the command
  kWheelsDisagree,     ///< not a possible rolling motion of four wheels
  kOpposedMotion,      ///< the joint keeps moving against its torque
  kHallDisagrees,      ///< Hall sensors and encoder of the motor disagree
  kHallSensesDiffer,   ///< Hall sensors and encoders of the four wheels do not count in the same sense
  kAwayFromTarget,     ///< a joint in position mode moves away from its target
  kBaseDrivenBack,     ///< the base moves against the torques of its wheels
};

/// Allowed range of a joint; unlimited by default, as for a wheel.
struct JointRange {
  double lower_rad = -std::numeric_limits<double>::infinity();
  double upper_rad = std::numeric_limits<double>::infinity();

  bool limited() const noexcept { return std::isfinite(lower_rad) || std::isfinite(upper_rad); }
  double width_rad() const noexcept { return upper_rad - lower_rad; }
};

/// The motor's rotor angle from its Hall sensors, with the encoder count. Only for drives that report both.
struct RotorReading {
  std::uint32_t number = 0;  ///< of the reading; 0: none yet
  double hall_turn = 0.0;    ///< within an electrical revolution, 0 to 1; in sixths or finer
  // Range of the encoder while the Hall sensors were read, in electrical revolutions. Zero and direction are
  // independent of those of `hall_turn`.
  double encoder_low_turn = 0.0;
  double encoder_high_turn = 0.0;
};

struct JointSample {
  /// Continuous, never wrapped; after a loss of power it continues from the last value. Homing sets it to
  /// zero.
  double position_rad = 0.0;
  double velocity_rad_per_s = 0.0;  ///< as the motor controller reports it: coarse and noisy at low speed
  double torque_Nm = 0.0;  ///< motor current times torque constant and gear ratio; not a torque sensor
  JointFault fault = JointFault::kNone;
  /// position_rad has the zero of the joint's range; otherwise its zero is the position at power-up.
  bool homed = false;
  RotorReading rotor{};  ///< only for drives that report it
};

}  // namespace hal
