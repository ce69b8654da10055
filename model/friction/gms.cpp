#include "model/friction/gms.h"

#include <cstdint>

namespace model::friction {
namespace {

constexpr std::size_t kSlipping = kMaxElements;
constexpr std::size_t kDirection = kMaxElements + 1;

}  // namespace

Gms::Gms(const Parameters& parameters)
    : parameters_(checked<Gms>(parameters)),
      curve_(parameters),
      elements_(kName, parameters.stiffness_Nm_per_rad, parameters.share),
      damping_Nm_s_per_rad_(elements_.of_elements(parameters.damping_Nm_s_per_rad)),
      attraction_Nm_per_s_(elements_.of_elements(parameters.attraction_Nm_per_s)) {}

double Gms::step(State& state, const Contact& contact, double dt_s) const noexcept {
  if (!usable(contact, dt_s)) return 0.0;
  const double velocity = contact.velocity_rad_per_s;
  const double direction = std::copysign(1.0, velocity);
  auto slipping = static_cast<std::uint32_t>(state.x[kSlipping]);
  if (velocity == 0 || direction != state.x[kDirection]) slipping = 0;
  state.x[kDirection] = velocity == 0 ? 0.0 : direction;

  const double level = curve_.level_Nm(velocity);
  const double way = velocity * dt_s;
  double sum = 0.0;
  for (std::size_t i = 0; i < elements_.count(); ++i) {
    const std::uint32_t bit = std::uint32_t{1} << i;
    const double rest = direction * elements_.share(i) * level;
    double& torque = state.x[i];
    if (velocity != 0) {
      // Also if the bound fell below a sticking element.
      const bool slips = (slipping & bit) != 0 || direction * (torque - rest) > 0;
      double z_per_s = velocity;
      if (slips) {
        const double per_s = attraction_Nm_per_s_[i] / level;
        torque = rest + (torque - rest) * std::exp(-per_s * dt_s);
        z_per_s = per_s * (rest - torque) * elements_.compliance_rad_per_Nm(i);
      } else {
        torque += elements_.stiffness_Nm_per_rad(i) * way;
        if (direction * (torque - rest) > 0) torque = rest;
        if (torque == rest) z_per_s = 0;
      }
      if (slips || torque == rest) slipping |= bit;
      sum += damping_Nm_s_per_rad_[i] * z_per_s;
    }
    sum += torque;
  }
  state.x[kSlipping] = static_cast<double>(slipping);
  return sum + parameters_.viscous_Nm_s_per_rad * velocity;
}

double Gms::steady_Nm(double velocity_rad_per_s) const noexcept {
  return std::copysign(curve_.level_Nm(velocity_rad_per_s), velocity_rad_per_s) +
         parameters_.viscous_Nm_s_per_rad * velocity_rad_per_s;
}

}  // namespace model::friction
