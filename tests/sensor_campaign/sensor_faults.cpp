#include "tests/sensor_campaign/sensor_faults.h"

namespace sensor_campaign {

using support::Channel;
using support::LieKind;

namespace {

/// The smallest reading of a board, in SI units of a wheel: of all joints one of the smallest scales.
constexpr double kLeastPosition_rad = -1.3e5;
constexpr double kLeastVelocity_rad_per_s = -8e6;
constexpr double kLeastTorque_Nm = -1.8e6;

/// The joint to which the cable of this joint's neighbour belongs.
std::size_t next_to(std::size_t joint) {
  const std::size_t first = joint < kWheels ? 0 : kWheels;
  const std::size_t count = joint < kWheels ? kWheels : kJoints - kWheels;
  return first + (joint - first + 1) % count;
}

}  // namespace

std::vector<support::SensorLie> SensorFault::on(std::size_t joint) const {
  double value = joint < kWheels ? wheel_value : arm_value;
  if (kind == LieKind::kSwapped) value = static_cast<double>(next_to(joint));
  std::vector<support::SensorLie> lies{{joint, channel, value, kind}};
  if (also) lies.push_back({joint, *also, value, kind});
  switch (others) {
    case Others::kNone: break;
    case Others::kNext: lies.push_back({next_to(joint), channel, value, kind}); break;
    case Others::kSide: lies.push_back({(joint + 2) % kWheels, channel, value, kind}); break;
    case Others::kAll:
      for (std::size_t i = 1; i < kWheels; ++i) lies.push_back({i, channel, value, kind});
      break;
  }
  return lies;
}

bool SensorFault::concerns(std::size_t joint) const {
  if (others == Others::kAll) return joint == 0;
  return others != Others::kSide || joint < kWheels;
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
  using Others = SensorFault::Others;
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
      {"velocity offset", Channel::kVelocity, LieKind::kJump, 0.5, 0.1},          // rad/s
      {"torque offset", Channel::kTorque, LieKind::kJump, 0.15, 1.5},             // N·m
      {"torque drifts", Channel::kTorque, LieKind::kDrift, 0.1, 1.0},             // N·m/s
      {"encoder drifts slowly", Channel::kEncoder, LieKind::kDrift, 0.02, 0.01},  // rad/s
      {"encoder pauses", Channel::kEncoder, LieKind::kPauses, 0.02, 0.02},        // s
      {"board pauses", Channel::kBoard, LieKind::kPauses, 0.02, 0.02},            // s
      {"velocity 50 ms late", Channel::kVelocity, LieKind::kLate, 0.05, 0.05},    // s
      {"bit 9 flips once", Channel::kPosition, LieKind::kGlitch, 0.031, 0.008},   // rad
      {"bit 13 flips once", Channel::kPosition, LieKind::kGlitch, 0.5, 0.12},     // rad
      {"bit 31 flips once", Channel::kPosition, LieKind::kGlitch, 1.3e5, 3e4},    // rad
      {"encoder fades to 0.7", Channel::kEncoder, LieKind::kFades, 0.7, 0.7},
      {"encoder slips once", Channel::kEncoder, LieKind::kSlips, 100, 100},    // s
      {"encoder slips often", Channel::kEncoder, LieKind::kSlips, 0.1, 0.1},   // s
      {"encoder slips slowly", Channel::kEncoder, LieKind::kSlips, 0.5, 0.5},  // s
      {"position INT_MIN", Channel::kPosition, LieKind::kConstant, kLeastPosition_rad, kLeastPosition_rad},
      {"velocity INT_MIN", Channel::kVelocity, LieKind::kConstant, kLeastVelocity_rad_per_s,
       kLeastVelocity_rad_per_s},
      {"torque INT_MIN", Channel::kTorque, LieKind::kConstant, kLeastTorque_Nm, kLeastTorque_Nm},
      {"encoder + torque x-1", Channel::kEncoder, LieKind::kFactor, -1, -1, Channel::kTorque},
      {"encoder + torque x0.5", Channel::kEncoder, LieKind::kFactor, 0.5, 0.5, Channel::kTorque},
      {"two encoders frozen", Channel::kEncoder, LieKind::kFactor, 0, 0, {}, Others::kNext},
      {"two encoders x2", Channel::kEncoder, LieKind::kFactor, 2, 2, {}, Others::kNext},
      {"two encoders x-1", Channel::kEncoder, LieKind::kFactor, -1, -1, {}, Others::kNext},
      {"one side x-1", Channel::kEncoder, LieKind::kFactor, -1, -1, {}, Others::kSide},
      {"all wheels x-1", Channel::kEncoder, LieKind::kFactor, -1, -1, {}, Others::kAll},
      {"all motors x-1", Channel::kMotor, LieKind::kFactor, -1, -1, {}, Others::kAll},
  };
}

std::string joint_name(std::size_t joint) {
  return joint < kWheels ? "wheel-" + std::to_string(joint + 1)
                         : "arm-" + std::to_string(joint - kWheels + 1);
}

}  // namespace sensor_campaign
