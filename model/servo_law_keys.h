/// @file
/// The numbers of a servo's law by name, for model files and recordings.
#pragma once
#include <array>
#include <string>
#include <string_view>

#include "model/servo_law.h"

namespace model {

struct ServoKey {
  std::string_view name;
  double ServoLaw::*member;
  double lower;
  double upper;
  bool of_voltage;  ///< only of a servo that is fed with a voltage
};
/// Gains are in units of the output, V or N·m, per rad, rad/s or rad·s.
inline constexpr std::array<ServoKey, 6> kServoKeys{
    {{"position_gain", &ServoLaw::position_gain, 0, 1e9, false},
     {"velocity_gain", &ServoLaw::velocity_gain, 0, 1e9, false},
     {"integral_gain", &ServoLaw::integral_gain, 0, 1e9, false},
     {"limit", &ServoLaw::limit, 1e-9, 1e9, false},
     {"torque_constant_Nm_per_A", &ServoLaw::torque_constant_Nm_per_A, 1e-9, 1e6, true},
     {"resistance_ohm", &ServoLaw::resistance_ohm, 1e-9, 1e9, true}}};

/// "position_gain, velocity_gain, ..."
inline std::string servo_keys() {
  std::string names;
  for (const ServoKey& key : kServoKeys) (names += names.empty() ? "" : ", ") += key.name;
  return names;
}

}  // namespace model
