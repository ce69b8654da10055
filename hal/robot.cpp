#include "hal/robot.h"

#include <array>
#include <cstdio>

#include "hal/seconds.h"

namespace hal {

const char* describe(Fault fault) noexcept {
  switch (fault) {
    case Fault::kNone: return "no fault";
    case Fault::kNotActive: return "the robot is not active";
    case Fault::kBadCommand: return "a command that is not a finite number";
    case Fault::kJointFault: return "a joint fault";
    case Fault::kFrameLost: return "no answer from the bus";
    case Fault::kPartialBus: return "some devices on the bus did not answer";
    case Fault::kSimulatorSilent:
      return "no answer from the simulated bus: youbot-sim was late, unless it ended or plays a fault; start "
             "it "
             "with the right to real-time priority (as root, or with CAP_SYS_NICE and CAP_IPC_LOCK), or give "
             "the "
             "machine less to do";
    case Fault::kLinkDown: return "the interface takes no frames";
    case Fault::kFrameLoss: return "too many frames were lost";
    case Fault::kOtherMaster: return "another master is on this bus";
  }
  return "unknown fault";
}

std::string Robot::explain(const CycleStatus& status) const {
  return status.fault == Fault::kJointFault ? hal::describe(status.joint_fault())
                                            : hal::describe(status.fault);
}

std::vector<std::string> sampling_notes(std::chrono::nanoseconds interval) {
  if (interval <= kLongestRegularSample) return {};
  std::array<char, 160> text{};
  const bool none = interval > kLongestCheckedSample;
  std::snprintf(
      text.data(), text.size(),
      "positions come every %.2f ms: %s of its sensors %s (docs/safety.md); %.4g ms or less would be needed",
      milliseconds(interval), none ? "no check" : "the check S3", none ? "runs" : "does not run",
      milliseconds(none ? kLongestCheckedSample : kLongestRegularSample));
  return {text.data()};
}

const char* describe(JointFault fault) noexcept {
  switch (fault) {
    case JointFault::kNone: return "no fault";
    case JointFault::kUndervoltage: return "undervoltage";
    case JointFault::kOvervoltage: return "overvoltage";
    case JointFault::kOvertemperature: return "overtemperature";
    case JointFault::kHallSensor: return "hall sensor error";
    case JointFault::kEncoder: return "encoder error";
    case JointFault::kCommandTimeout: return "process data stopped (command timeout)";
    case JointFault::kI2t: return "winding too hot (I2t)";
    case JointFault::kNotInitialized: return "the commutation is not known or could not be found";
    case JointFault::kEmergencyStop: return "emergency stop";
    case JointFault::kBadSample: return "a measured value that is not a finite number";
    case JointFault::kRefused: return "the drive refused a request";
    case JointFault::kNotPrepared: return "the drive could not be made ready";
    case JointFault::kRestarted: return "the drive was restarted";
    case JointFault::kEncoderStill:
      return "its position stands still while its motor is driven: the encoder is stuck, or its reading";
    case JointFault::kVelocityDisagrees:
      return "its reported velocity is not its position's rate of change: one of the two readings is wrong";
    case JointFault::kVelocityStep:
      return "its position changed speed faster than any motion can: the encoder or its scale is wrong";
    case JointFault::kTorqueDisagrees:
      return "its measured torque does not follow the command: the current reading or the drive is wrong";
    case JointFault::kWheelsDisagree:
      return "the four wheels cannot roll as they report: one encoder or its scale is wrong";
    case JointFault::kOpposedMotion:
      return "it keeps moving against its torque: the encoder counts backwards, or something drives the "
             "joint";
    case JointFault::kHallDisagrees:
      return "its motor's Hall sensors do not turn as its encoder counts: the encoder or its scale is wrong, "
             "or a Hall sensor";
    case JointFault::kHallSensesDiffer:
      return "the four wheels' Hall sensors and encoders do not count in the same sense: an encoder counts "
             "backwards, or a board differs in parameter 251 or 254";
    case JointFault::kAwayFromTarget:
      return "it moves away from the target of its position controller: the encoder counts backwards, or "
             "something pushes the joint";
    case JointFault::kBaseDrivenBack:
      return "the base moves against the torques of its wheels: their encoders or motors turn backwards, or "
             "something pushes the base";
  }
  return "unknown joint fault";
}

}  // namespace hal
