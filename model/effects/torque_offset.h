/// @file
/// A constant torque on the joint: a weight on a drum, a preloaded spring, an offset of the current sensor.
#pragma once
#include <array>

#include "model/effects/effect.h"

namespace model::effects {

struct TorqueOffsetParameters {
  double torque_Nm = 0.005;  ///< positive against positive motion
};

class TorqueOffset : public WithParameters<TorqueOffset, TorqueOffsetParameters> {
 public:
  static constexpr std::string_view kName = "torque_offset";
  static constexpr std::string_view kShows =
      "more torque one way than the other by the same amount at every speed";
  static constexpr auto kParameters = std::to_array<ParameterInfo<TorqueOffsetParameters>>(
      {{"torque_Nm", member<&TorqueOffsetParameters::torque_Nm>, -kMaxTorque_Nm, kMaxTorque_Nm}});
  static constexpr auto kAmplitudes = std::to_array<std::string_view>({"torque_Nm"});
  using WithParameters::WithParameters;

  double load_Nm(double /*position_rad*/) const noexcept { return parameters_.torque_Nm; }
};

}  // namespace model::effects
