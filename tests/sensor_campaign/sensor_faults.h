/// @file
/// Sensor faults that are tried on every joint.
#pragma once
#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "tests/support/lying_robot.h"

namespace sensor_campaign {

/// Wheels 1 to 4, then arm joints 1 to 5.
inline constexpr std::size_t kWheels = 4;
inline constexpr std::size_t kJoints = 9;

struct SensorFault {
  std::string name;
  support::Channel channel;
  support::LieKind kind;
  double wheel_value;  ///< support::SensorLie::value of a wheel
  double arm_value;    ///< and of an arm joint
  /// A second faulty sensor, in the same way: another one of the joint, or that of the next joint.
  std::optional<support::Channel> also{};
  bool neighbour_too = false;

  std::vector<support::SensorLie> on(std::size_t joint) const;
};

/// A sensor that is constant, or shows half, double or the negative value.
std::vector<SensorFault> factors();
/// All other faults.
std::vector<SensorFault> other_faults();

/// "wheel-1", "arm-5".
std::string joint_name(std::size_t joint);

}  // namespace sensor_campaign
