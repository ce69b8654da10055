/// @file
/// The motor delivers no small torques: a smaller command is delivered at the threshold.
#pragma once
#include <array>
#include <cmath>

#include "model/effects/effect.h"

namespace model::effects {

struct TorqueDeadbandParameters {
  double threshold_Nm = 0.03;
};

/// The youBot's 0.03 N·m [thesis 2.5.2]. A command of exactly zero delivers nothing.
class TorqueDeadband : public WithParameters<TorqueDeadband, TorqueDeadbandParameters> {
 public:
  static constexpr std::string_view kName = "torque_deadband";
  static constexpr std::string_view kShows =
      "measured torque stays at one magnitude and jumps where the command crosses zero";
  static constexpr auto kParameters = std::to_array<ParameterInfo<TorqueDeadbandParameters>>(
      {{"threshold_Nm", member<&TorqueDeadbandParameters::threshold_Nm>, 0, kMostTorque_Nm}});
  using WithParameters::WithParameters;

  double deliver(DelayLine& /*line*/, double torque_Nm, double /*interval_s*/) const noexcept {
    if (torque_Nm == 0 || std::abs(torque_Nm) >= parameters_.threshold_Nm) return torque_Nm;
    return std::copysign(parameters_.threshold_Nm, torque_Nm);
  }
};

}  // namespace model::effects
