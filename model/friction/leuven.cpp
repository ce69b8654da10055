#include "model/friction/leuven.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace model::friction {

Leuven::Leuven(const Parameters& parameters)
    : parameters_(checked<Leuven>(parameters)),
      curve_(parameters),
      elements_(kName, parameters.stiffness_Nm_per_rad, parameters.share) {}

Leuven::Rate Leuven::rate_at(double hysteresis_Nm, double level_Nm) const noexcept {
  const double n = parameters_.transition_exponent;
  const double q = hysteresis_Nm / level_Nm;
  // |q|ⁿ⁻¹, bounded so that its products are finite: q is huge if the level falls to zero.
  const double below = n == 1 ? 1.0 : n == 2 ? std::abs(q) : std::min(std::pow(std::abs(q), n - 1), 1e200);
  return {1 - q * below, -n * below / level_Nm};
}

double Leuven::step(State& state, const Contact& contact, double dt_s) const noexcept {
  if (!usable(contact, dt_s)) return 0.0;
  const double velocity = contact.velocity_rad_per_s;
  const double direction = std::copysign(1.0, velocity);
  const double level = curve_.level_Nm(velocity);
  const double bound = curve_.most_Nm();
  double way = std::abs(velocity) * dt_s;
  double hysteresis = 0.0;  // F_h along the motion
  for (std::size_t i = 0; i < elements_.count(); ++i) hysteresis += direction * state.x[i];

  Rate rate = rate_at(hysteresis, level);
  // Each iteration except the last ends with one more slider slipping.
  for (std::size_t turn = 0; turn <= elements_.count() && way > 0; ++turn) {
    // If z is above s(v) after the speed has grown, it decreases although the joint moves on.
    const double towards = direction * std::copysign(1.0, rate.value);
    double stiffness = 0.0;
    double to_slip = std::numeric_limits<double>::infinity();
    for (std::size_t i = 0; i < elements_.count(); ++i) {
      const double left = elements_.share(i) * bound - towards * state.x[i];
      if (!(left > 0)) continue;
      stiffness += elements_.stiffness_Nm_per_rad(i);
      to_slip = std::min(to_slip, left * elements_.compliance_rad_per_Nm(i));
    }
    const double speed = std::abs(rate.value);
    if (stiffness == 0 || speed < 1e-14) break;  // F_h = s(v)
    const double decay = -rate.slope_per_Nm * stiffness;
    const double exponent = decay * way;
    double dz = speed * (exponent > 1e-6 ? (1 - std::exp(-exponent)) / decay : way * (1 - exponent / 2));
    const double to_level = std::abs(level - hysteresis) / stiffness;
    if (to_slip <= std::min(dz, to_level)) {
      dz = to_slip;
      const double used = std::min(decay * dz / speed, 1 - 1e-16);
      way -= used > 1e-6 ? -std::log(1 - used) / decay : dz / speed * (1 + used / 2);
    } else {
      dz = std::min(dz, to_level);
      way = 0;
    }
    double along_z = 0.0;
    for (std::size_t i = 0; i < elements_.count(); ++i) {
      const double most = elements_.share(i) * bound;
      const double moved = towards * state.x[i] + elements_.stiffness_Nm_per_rad(i) * dz;
      // Rounding must not leave a slider marginally below slipping.
      const double held = moved > most * (1 - 1e-12) ? most : moved;
      state.x[i] = towards * held;
      along_z += held;
    }
    hysteresis = direction * towards * along_z;
    rate = rate_at(hysteresis, level);
  }
  return direction * hysteresis + parameters_.damping_Nm_s_per_rad * velocity * rate.value +
         parameters_.viscous_Nm_s_per_rad * velocity;
}

double Leuven::steady_Nm(double velocity_rad_per_s) const noexcept {
  return std::copysign(curve_.level_Nm(velocity_rad_per_s), velocity_rad_per_s) +
         parameters_.viscous_Nm_s_per_rad * velocity_rad_per_s;
}

}  // namespace model::friction
