#include "identification/experiments/compensation.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

namespace identification::experiments {

Compensation::Compensation(const CompensationConfig& config, model::friction::SlidingTable friction,
                           double passive_gain, double period_s)
    : config_(checked(config)),
      observer_(std::move(friction),
                {.filter = {.period_s = period_s}, .blend_speed_rad_per_s = config.blend_speed_rad_per_s}),
      compensator_({.margin = config.margin, .full_command_Nm = config.full_command_Nm}),
      passive_gain_(passive_gain) {}

double Compensation::duration_s(int /*measurement*/) const noexcept { return config_.duration_s; }

void Compensation::begin(int measurement, const Reading& reading) noexcept {
  compensate_ = measurement % 2 == 1;
  reference_rad_ = reading.position_rad;
  observer_.reset(reading.position_rad);
  extreme_rad_ = first_swing_rad_ = last_off_rad_ = 0.0;
  swings_ = 0;
  finished_ = false;
}

void Compensation::count(double off_rad) noexcept {
  // A swing ends where it crosses the reference; one that does not come back far enough does not count.
  if (off_rad * extreme_rad_ < 0) extreme_rad_ = 0.0;
  const bool counted_before = std::abs(extreme_rad_) >= config_.smallest_swing_rad;
  if (std::abs(off_rad) > std::abs(extreme_rad_)) extreme_rad_ = off_rad;
  if (!counted_before && std::abs(extreme_rad_) >= config_.smallest_swing_rad) ++swings_;
  if (swings_ == 1 && std::abs(extreme_rad_) >= config_.smallest_swing_rad) first_swing_rad_ = extreme_rad_;
  last_off_rad_ = off_rad;
}

SetPoint Compensation::step(const Reading& reading) noexcept {
  const control::FrictionEstimate estimate = observer_.step(reading.position_rad);
  if (reading.time_s < config_.rest_s) {
    reference_rad_ = reading.position_rad + config_.reference_rad;
    return {{}, reference_rad_};
  }
  finished_ = finished_ || reading.time_s >= config_.duration_s;
  if (finished_) return {{}, reference_rad_};
  if (reading.time_s < config_.rest_s + config_.push_duration_s)
    return {hal::JointCommand::torque_Nm(config_.push_Nm), reference_rad_};

  const double off_rad = reading.position_rad - reference_rad_;
  count(off_rad);
  double torque_Nm = config_.extra_torque_Nm - config_.stiffness_Nm_per_rad * off_rad;
  if (compensate_) torque_Nm += compensator_.torque_Nm(torque_Nm, estimate, observer_);
  return {
      hal::JointCommand::torque_Nm(std::clamp(torque_Nm, -config_.torque_limit_Nm, config_.torque_limit_Nm)),
      reference_rad_};
}

std::span<const char* const> Compensation::result_columns() const noexcept {
  static constexpr std::array<const char*, 5> kColumns{"compensation", "swings", "first_swing_rad",
                                                       "final_error_rad", "passive_gain"};
  return kColumns;
}

void Compensation::write_result(std::span<double> values) const noexcept {
  values[0] = compensate_ ? 1.0 : 0.0;
  values[1] = swings_;
  values[2] = first_swing_rad_;
  values[3] = last_off_rad_;
  values[4] = passive_gain_;
}

}  // namespace identification::experiments
