/// @file
/// End stops of a joint: a damped spring on either side that only pushes.
#pragma once
#include <algorithm>

namespace sim {

/// Joint side, rad and N·m. Cycle: pure arithmetic.
struct EndStops {
  double lower_rad = 0.0;
  double upper_rad = 0.0;
  double stiffness_Nm_per_rad = 2e4;
  double damping_Nm_s_per_rad = 0.0;

  /// Against the motion, as a load of the joint: positive at the upper stop.
  double load_Nm(double position_rad, double velocity_rad_per_s) const noexcept {
    const auto push = [this](double depth_rad, double inwards_rad_per_s) {
      return depth_rad > 0
                 ? std::max(0.0, stiffness_Nm_per_rad * depth_rad + damping_Nm_s_per_rad * inwards_rad_per_s)
                 : 0.0;
    };
    return push(position_rad - upper_rad, velocity_rad_per_s) -
           push(lower_rad - position_rad, -velocity_rad_per_s);
  }
};

}  // namespace sim
