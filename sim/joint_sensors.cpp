#include "sim/joint_sensors.h"

#include <cmath>

namespace sim {
namespace {

double quantised(double value, double resolution) noexcept {
  return resolution > 0 ? std::round(value / resolution) * resolution : value;
}

}  // namespace

void JointSensors::update(double position_rad, double torque_Nm, double interval_s) noexcept {
  const double last_rad = position_rad_;
  position_rad_ = quantised(position_rad, parameters_.position_resolution_rad);
  const double velocity_noise = parameters_.velocity_noise_rad_per_s * normal_(random_);
  velocity_rad_per_s_ = quantised((position_rad_ - last_rad) / interval_s + velocity_noise,
                                  parameters_.velocity_resolution_rad_per_s);
  torque_Nm_ =
      quantised(torque_Nm + parameters_.torque_noise_Nm * normal_(random_), parameters_.torque_resolution_Nm);
}

}  // namespace sim
