#include "control/friction_observer.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <utility>

namespace control {

FrictionObserver::FrictionObserver(model::friction::SlidingTable table, const Config& config,
                                   model::PositionTorque position)
    : table_(std::move(table)),
      position_(std::move(position)),
      filter_(config.filter),
      blend_speed_rad_per_s_(config.blend_speed_rad_per_s) {
  if (!(blend_speed_rad_per_s_ > 0))
    throw std::invalid_argument("friction observer: blend_speed_rad_per_s must be positive");
}

FrictionEstimate FrictionObserver::step(double position_rad, std::optional<double> elapsed_s) noexcept {
  const double velocity = filter_.step(position_rad, elapsed_s).velocity;
  const double direction = std::clamp(velocity / blend_speed_rad_per_s_, -1.0, 1.0);
  return {velocity, direction * table_.level_Nm(velocity), 1 - std::abs(direction),
          position_.at_Nm(position_rad)};
}

}  // namespace control
