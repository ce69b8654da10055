#include "identification/experiments/stick_slip.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace identification::experiments {

double StickSlip::duration_s(int /*measurement*/) const noexcept {
  return config_.rest_s + config_.duration_s;
}

void StickSlip::begin(int measurement, const Reading& reading) noexcept {
  direction_ = measurement % 2 == 0 ? 1.0 : -1.0;
  origin_rad_ = reading.position_rad;
  slipping_ = finished_ = false;
  slips_ = 0;
  slid_rad_ = held_Nm_ = released_Nm_ = 0.0;
}

void StickSlip::watch(const Reading& reading) noexcept {
  const double speed = direction_ * reading.velocity_rad_per_s;
  const double travel_rad = direction_ * (reading.position_rad - origin_rad_);
  const double pull_Nm = std::isfinite(reading.command_Nm) ? direction_ * reading.command_Nm : 0.0;
  if (!slipping_) {
    held_Nm_ = std::max(held_Nm_, pull_Nm);
    if (speed > config_.slip_speed_rad_per_s) {
      slipping_ = true;
    } else if (std::abs(speed) < config_.slip_speed_rad_per_s / 2) {
      slip_begin_rad_ = travel_rad;
    }
  } else if (speed < config_.slip_speed_rad_per_s / 2) {
    slipping_ = false;
    ++slips_;
    slid_rad_ += travel_rad - slip_begin_rad_;
    released_Nm_ += held_Nm_;
    held_Nm_ = 0.0;
  }
}

SetPoint StickSlip::step(const Reading& reading) noexcept {
  const double pulled_s = reading.time_s - config_.rest_s;
  if (pulled_s < 0) origin_rad_ = reading.position_rad;
  finished_ = finished_ || reading.time_s >= duration_s(0);
  if (pulled_s < 0 || finished_) return {{}, reading.position_rad};
  watch(reading);
  const double end_rad = origin_rad_ + direction_ * config_.speed_rad_per_s * pulled_s;
  const double pull_Nm = std::clamp(config_.stiffness_Nm_per_rad * (end_rad - reading.position_rad),
                                    -config_.torque_limit_Nm, config_.torque_limit_Nm);
  return {hal::JointCommand::torque_Nm(pull_Nm), end_rad};
}

std::span<const char* const> StickSlip::result_columns() const noexcept {
  static constexpr std::array<const char*, 4> kColumns{"direction", "slips", "slip_rad", "release_Nm"};
  return kColumns;
}

void StickSlip::write_result(std::span<double> values) const noexcept {
  const auto slips = static_cast<double>(slips_);
  values[0] = direction_;
  values[1] = slips;
  values[2] = slips_ > 0 ? slid_rad_ / slips : kUnknown;
  values[3] = slips_ > 0 ? released_Nm_ / slips : kUnknown;
}

std::string StickSlip::not_measured(std::size_t column) const {
  return column < 2 ? "" : "did not slip at up to " + number_text(config_.torque_limit_Nm) + " N·m";
}

}  // namespace identification::experiments
