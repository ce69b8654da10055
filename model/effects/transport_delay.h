/// @file
/// Commands arrive late.
#pragma once
#include <array>

#include "model/effects/effect.h"

namespace model::effects {

struct TransportDelayParameters {
  double delay_s = 0.005;
};

class TransportDelay : public WithParameters<TransportDelay, TransportDelayParameters> {
 public:
  static constexpr std::string_view kName = "transport_delay";
  static constexpr std::string_view kShows =
      "delivered torque follows the command later, by the same time at every frequency";
  static constexpr auto kParameters = std::to_array<ParameterInfo<TransportDelayParameters>>(
      {{"delay_s", member<&TransportDelayParameters::delay_s>, 0, DelayLine::kLongest_s}});
  using WithParameters::WithParameters;

  double deliver(DelayLine& line, double torque_Nm, double interval_s) const noexcept {
    return line.pass(torque_Nm, parameters_.delay_s, interval_s);
  }
};

}  // namespace model::effects
