/// @file
/// A band of speed in which friction falls below the straight line.
#pragma once
#include <array>
#include <cmath>

#include "model/effects/effect.h"

namespace model::effects {

struct MidspeedDipParameters {
  double depth_Nm = 0.01;
  double centre_rad_per_s = 2.5;
  double width_rad_per_s = 1;
};

/// −depth·exp(−((|v| − centre)/width)²); measured on youBot wheels between about 1 and 4 rad/s.
class MidspeedDip : public WithParameters<MidspeedDip, MidspeedDipParameters> {
 public:
  static constexpr std::string_view kName = "midspeed_dip";
  static constexpr std::string_view kShows =
      "less friction than Coulomb and viscous in a band of speed, both directions, back on the line above it";
  static constexpr auto kParameters = std::to_array<ParameterInfo<MidspeedDipParameters>>(
      {{"depth_Nm", member<&MidspeedDipParameters::depth_Nm>, 0, kMostTorque_Nm},
       {"centre_rad_per_s", member<&MidspeedDipParameters::centre_rad_per_s>, 0, kMostSpeed_rad_per_s},
       {"width_rad_per_s", member<&MidspeedDipParameters::width_rad_per_s>, 1e-3, kMostSpeed_rad_per_s}});
  using WithParameters::WithParameters;

  double level_Nm(const Sliding& sliding) const noexcept {
    return -parameters_.depth_Nm *
           shape(sliding.speed_rad_per_s, parameters_.centre_rad_per_s, parameters_.width_rad_per_s);
  }
  /// 1 in the middle of the band, towards 0 outside.
  static double shape(double speed_rad_per_s, double centre_rad_per_s, double width_rad_per_s) noexcept {
    const double off = (speed_rad_per_s - centre_rad_per_s) / width_rad_per_s;
    return std::exp(-off * off);
  }
};

}  // namespace model::effects
