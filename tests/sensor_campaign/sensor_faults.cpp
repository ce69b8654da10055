#include "tests/sensor_campaign/sensor_faults.h"

namespace sensor_campaign {

using support::Channel;
using support::LieKind;

support::SensorLie SensorFault::on(std::size_t joint) const {
  const bool wheel = joint < kWheels;
  double value = wheel ? wheel_value : arm_value;
  if (kind == LieKind::kSwapped) {  // the cables of neighbours
    const std::size_t first = wheel ? 0 : kWheels;
    const std::size_t count = wheel ? kWheels : kJoints - kWheels;
    value = static_cast<double>(first + (joint - first + 1) % count);
  }
  return {joint, channel, value, kind};
}

std::vector<SensorFault> factors() {
  struct Named {
    const char* name;
    Channel channel;
  };
  std::vector<SensorFault> faults;
  for (const Named& sensor : {Named{"encoder", Channel::kEncoder}, Named{"position", Channel::kPosition},
                              Named{"velocity", Channel::kVelocity}, Named{"torque", Channel::kTorque}})
    for (const auto& [text, factor] :
         {std::pair{" frozen", 0.0}, std::pair{" x0.5", 0.5}, std::pair{" x2", 2.0}, std::pair{" x-1", -1.0}})
      faults.push_back({sensor.name + std::string(text), sensor.channel, LieKind::kFactor, factor, factor});
  faults.push_back({"board frozen", Channel::kBoard, LieKind::kFactor, 0, 0});
  return faults;
}

std::vector<SensorFault> other_faults() {
  return {
      {"encoder drifts", Channel::kEncoder, LieKind::kDrift, 0.2, 0.05},           // rad/s
      {"position drifts", Channel::kPosition, LieKind::kDrift, 0.2, 0.05},         // rad/s
      {"encoder jumps", Channel::kEncoder, LieKind::kJump, 0.5, 0.1},              // rad
      {"encoder 20 ms late", Channel::kEncoder, LieKind::kLate, 0.02, 0.02},       // s
      {"encoder 50 ms late", Channel::kEncoder, LieKind::kLate, 0.05, 0.05},       // s
      {"board 50 ms late", Channel::kBoard, LieKind::kLate, 0.05, 0.05},           // s
      {"encoder coarse", Channel::kEncoder, LieKind::kCoarse, 0.004, 0.001},       // rad: 64 counts
      {"position noise", Channel::kPosition, LieKind::kNoisy, 6e-4, 1e-4},         // rad: 10 counts
      {"velocity noise x10", Channel::kVelocity, LieKind::kNoisy, 0.3, 0.05},      // rad/s
      {"torque noise x10", Channel::kTorque, LieKind::kNoisy, 0.015, 0.1},         // N·m
      {"encoder loose", Channel::kEncoder, LieKind::kLoose, 0.02, 0.02},           // s
      {"encoder saturated", Channel::kEncoder, LieKind::kSaturated, 1.0, 0.05},    // rad/s
      {"velocity saturated", Channel::kVelocity, LieKind::kSaturated, 1.0, 0.05},  // rad/s
      {"torque saturated", Channel::kTorque, LieKind::kSaturated, 0.2, 1.0},       // N·m
      {"encoders swapped", Channel::kEncoder, LieKind::kSwapped, 0, 0},
      {"velocity offset", Channel::kVelocity, LieKind::kJump, 0.5, 0.1},  // rad/s
      {"torque offset", Channel::kTorque, LieKind::kJump, 0.15, 1.5},     // N·m
      {"torque drifts", Channel::kTorque, LieKind::kDrift, 0.1, 1.0},     // N·m/s
  };
}

std::string joint_name(std::size_t joint) {
  return joint < kWheels ? "wheel-" + std::to_string(joint + 1)
                         : "arm-" + std::to_string(joint - kWheels + 1);
}

}  // namespace sensor_campaign
