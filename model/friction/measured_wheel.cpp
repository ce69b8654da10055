#include "model/friction/measured_wheel.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>

#include "model/friction/wheel_curve.h"

namespace model::friction {
namespace {

constexpr double kSpacing_rad_per_s = 0.005;

SlidingTable table_of(const MeasuredWheel::Parameters& parameters) {
  const MeasuredWheel::Parameters& p = checked<MeasuredWheel>(parameters);
  if (p.wheel != std::floor(p.wheel))
    throw std::invalid_argument("friction law measured_wheel: wheel = " + std::to_string(p.wheel) +
                                ", expected a whole number");
  const int wheel = static_cast<int>(p.wheel);
  if (p.held_below_rad_per_s == 0)
    return wheel_table(wheel, {.spacing_rad_per_s = kSpacing_rad_per_s}).scaled(p.scale);
  const auto curve_Nm = [&](double velocity_rad_per_s) {
    const double speed = std::max(std::abs(velocity_rad_per_s), p.held_below_rad_per_s);
    return wheel_curve_Nm(wheel, std::copysign(speed, velocity_rad_per_s));
  };
  return SlidingTable(curve_Nm, {.spacing_rad_per_s = kSpacing_rad_per_s, .breakaway_band_rad_per_s = 0})
      .scaled(p.scale);
}

/// Maximum rise with speed, in either direction.
double steepest(const SlidingTable& table) {
  const int intervals = static_cast<int>(SlidingTable::Grid{}.top_speed_rad_per_s / kSpacing_rad_per_s);
  double slope = 0.0;
  for (int i = 0; i < intervals; ++i)
    for (const double step : {-kSpacing_rad_per_s, kSpacing_rad_per_s})
      slope =
          std::max(slope, (table.level_Nm((i + 1) * step) - table.level_Nm(i * step)) / kSpacing_rad_per_s);
  return slope;
}

}  // namespace

MeasuredWheel::MeasuredWheel(const Parameters& parameters)
    : parameters_(parameters), table_(table_of(parameters)), steepest_Nm_s_per_rad_(steepest(table_)) {}

double MeasuredWheel::step(State& /*state*/, const Contact& contact, double dt_s) const noexcept {
  if (!usable(contact, dt_s)) return 0.0;
  if (contact.velocity_rad_per_s == 0)
    return std::clamp(contact.applied_torque_Nm, -table_.breakaway_Nm(-1), table_.breakaway_Nm(1));
  return steady_Nm(contact.velocity_rad_per_s);
}

bool MeasuredWheel::holds(const Contact& contact) const noexcept {
  return contact.velocity_rad_per_s == 0 &&
         std::abs(contact.applied_torque_Nm) <= table_.breakaway_Nm(contact.applied_torque_Nm);
}

double MeasuredWheel::steady_Nm(double velocity_rad_per_s) const noexcept {
  return std::copysign(table_.level_Nm(velocity_rad_per_s), velocity_rad_per_s);
}

double MeasuredWheel::max_step_s(double inertia_kg_m2) const noexcept {
  return coupled_step_limit_s(0, steepest_Nm_s_per_rad_, inertia_kg_m2);
}

}  // namespace model::friction
