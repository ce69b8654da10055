#include "model/friction/dissipation.h"

namespace model::friction {

std::optional<double> driving_velocity_rad_per_s(const std::function<double(double)>& friction_Nm,
                                                 double top_speed_rad_per_s) {
  constexpr int kSpeeds = 2000;
  for (int i = 1; i <= kSpeeds; ++i)
    for (const double sign : {1.0, -1.0}) {
      const double velocity = sign * top_speed_rad_per_s * i / kSpeeds;
      if (friction_Nm(velocity) * velocity < 0) return velocity;
    }
  return std::nullopt;
}

}  // namespace model::friction
