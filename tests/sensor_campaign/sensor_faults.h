/// @file
/// Sensor faults that are tried on every joint.
#pragma once
#include <cstddef>
#include <cstdint>
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
  /// A second faulty sensor of the joint, in the same way.
  std::optional<support::Channel> also{};
  /// Other joints whose sensors are wrong in the same way.
  enum class Others : std::uint8_t {
    kNone,
    kNext,  ///< the next joint
    kSide,  ///< the other wheel on the same side: wheels only
    kAll,   ///< all wheels: only once, not at each wheel
  };
  Others others = Others::kNone;

  /// Whether the fault is tried at this joint.
  bool concerns(std::size_t joint) const;

  std::vector<support::SensorLie> on(std::size_t joint) const;
};

/// A sensor that is constant, or shows half, double or the negative value.
std::vector<SensorFault> factors();
/// All other faults.
std::vector<SensorFault> other_faults();

/// "wheel-1", "arm-5".
std::string joint_name(std::size_t joint);

}  // namespace sensor_campaign
