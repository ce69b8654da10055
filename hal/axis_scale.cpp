#include "hal/axis_scale.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <stdexcept>
#include <string>

namespace hal {
namespace {

double positive(double value, const char* name) {
  if (std::isfinite(value) && value > 0) return value;
  throw std::invalid_argument(std::string("axis scale: ") + name + " must be finite and positive, not " +
                              std::to_string(value));
}

std::int32_t to_count(double value) noexcept {
  if (std::isnan(value)) return 0;
  constexpr double kLowest = std::numeric_limits<std::int32_t>::min();
  constexpr double kHighest = std::numeric_limits<std::int32_t>::max();
  return static_cast<std::int32_t>(std::clamp(std::round(value), kLowest, kHighest));
}

}  // namespace

AxisScale::AxisScale(const AxisConstants& constants) {
  constexpr double kTurn_rad = 2 * std::numbers::pi;
  const double gear = positive(constants.gear_ratio, "gear_ratio");
  const double ticks = positive(constants.ticks_per_motor_rev, "ticks_per_motor_rev");
  const double k_t = positive(constants.torque_constant_Nm_per_A, "torque_constant_Nm_per_A");
  const double sign = constants.inverted ? -1.0 : 1.0;
  rad_per_tick_ = sign * kTurn_rad / (ticks * gear);
  rad_per_s_per_rpm_ = sign * kTurn_rad / (60 * gear);
  Nm_per_mA_ = sign * 1e-3 * k_t * gear;
}

std::int32_t AxisScale::motor_ticks(double position_rad) const noexcept {
  return to_count(position_rad / rad_per_tick_);
}
std::int32_t AxisScale::motor_rpm(double velocity_rad_per_s) const noexcept {
  return to_count(velocity_rad_per_s / rad_per_s_per_rpm_);
}
std::int32_t AxisScale::motor_current_mA(double torque_Nm) const noexcept {
  return to_count(torque_Nm / Nm_per_mA_);
}

double AxisScale::position_resolution_rad() const noexcept { return std::abs(rad_per_tick_); }
double AxisScale::velocity_resolution_rad_per_s() const noexcept { return std::abs(rad_per_s_per_rpm_); }
double AxisScale::torque_resolution_Nm() const noexcept { return std::abs(Nm_per_mA_); }

}  // namespace hal
