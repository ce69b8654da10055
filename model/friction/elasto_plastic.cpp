#include "model/friction/elasto_plastic.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace model::friction {
namespace {

/// du/dx and its derivative with respect to u, for the deflection u along the motion over the displacement x.
struct Rate {
  double value;
  double slope_per_rad;
};

Rate rate_at(double u, double breakaway, double limit) noexcept {
  if (u <= breakaway) return {1.0, 0.0};
  if (u >= limit) return {1 - u / limit, -1 / limit};
  const double per_rad = std::numbers::pi / (limit - breakaway);
  const double angle = per_rad * (u - 0.5 * (breakaway + limit));
  const double sine = std::sin(angle);
  const double alpha = 0.5 + 0.5 * sine;
  // |angle| <= π/2, so the cosine is the positive root.
  const double alpha_per_rad = 0.5 * per_rad * std::sqrt(std::max(0.0, 1 - sine * sine));
  return {1 - alpha * u / limit, -(alpha + alpha_per_rad * u) / limit};
}

/// u after a displacement of `way`.
double advanced(double u, double way, double breakaway, double limit) noexcept {
  if (u < breakaway) {
    const double elastic = std::min(way, breakaway - u);
    u += elastic;
    way -= elastic;
  }
  if (way <= 0) return u;
  if (u >= limit) return limit + (u - limit) * std::exp(-way / limit);
  if (way > 40 * limit) return limit;  // closer than double precision resolves
  const double parts = std::clamp(std::ceil(4 * way / (limit - breakaway)), 1.0, 2.0);
  const double part = way / parts;
  for (double n = 0; n < parts; ++n) {
    const Rate rate = rate_at(u, breakaway, limit);
    const double exponent = rate.slope_per_rad * part;
    u += rate.value * part * (exponent < -1e-6 ? (std::exp(exponent) - 1) / exponent : 1 + exponent / 2);
    if (u >= limit) return limit;
  }
  return u;
}

}  // namespace

ElastoPlastic::ElastoPlastic(const Parameters& parameters)
    : parameters_(checked<ElastoPlastic>(parameters)),
      curve_(parameters),
      breakaway_rad_(parameters.breakaway_share * curve_.least_Nm() / parameters.stiffness_Nm_per_rad) {}

double ElastoPlastic::step(State& state, const Contact& contact, double dt_s) const noexcept {
  if (!usable(contact, dt_s)) return 0.0;
  const double velocity = contact.velocity_rad_per_s;
  const double direction = std::copysign(1.0, velocity);
  const double limit = curve_.level_Nm(velocity) / parameters_.stiffness_Nm_per_rad;
  const double u = advanced(direction * state.x[0], std::abs(velocity) * dt_s, breakaway_rad_, limit);
  state.x[0] = direction * u;
  const double z_per_s = velocity * rate_at(u, breakaway_rad_, limit).value;
  return parameters_.stiffness_Nm_per_rad * state.x[0] + parameters_.damping_Nm_s_per_rad * z_per_s +
         parameters_.viscous_Nm_s_per_rad * velocity;
}

double ElastoPlastic::steady_Nm(double velocity_rad_per_s) const noexcept {
  return std::copysign(curve_.level_Nm(velocity_rad_per_s), velocity_rad_per_s) +
         parameters_.viscous_Nm_s_per_rad * velocity_rad_per_s;
}

}  // namespace model::friction
