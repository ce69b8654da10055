#include "hal/velocity_filter.h"

#include <cmath>
#include <numbers>

namespace hal {

Eigen::Vector3d VelocityFilter::update(const Eigen::Vector3d& position_m,
                                       std::chrono::nanoseconds stamp) noexcept {
  if (!has_position_) {
    velocity_m_per_s_.setZero();
    has_position_ = true;
  } else if (stamp > stamp_) {
    const double dt_s = std::chrono::duration<double>(stamp - stamp_).count();
    const double share = -std::expm1(-2.0 * std::numbers::pi * cutoff_Hz_ * dt_s);
    velocity_m_per_s_ += share * ((position_m - position_m_) / dt_s - velocity_m_per_s_);
  } else {
    return velocity_m_per_s_;
  }
  position_m_ = position_m;
  stamp_ = stamp;
  return velocity_m_per_s_;
}

}  // namespace hal
