/// @file
/// A friction law moved along a path, for plots.
#pragma once
#include <functional>
#include <span>
#include <vector>

#include "model/friction/any_law.h"

namespace youbot_bench::thesis {

struct LawSweep {
  std::vector<double> time_s;
  std::vector<double> position_rad;
  std::vector<double> velocity_rad_per_s;
  std::vector<double> torque_Nm;
};
/// From rest and relaxed, along a position over time.
LawSweep sweep(const model::friction::AnyLaw& law, const std::function<double(double time_s)>& position_rad,
               double duration_s, double step_s);
/// From one turning point to the next at constant speed.
LawSweep through(const model::friction::AnyLaw& law, std::span<const double> points_rad,
                 double speed_rad_per_s, double step_s);

}  // namespace youbot_bench::thesis
