#include "control/state_variable_filter.h"

#include <cmath>
#include <complex>
#include <stdexcept>
#include <string>

namespace control {
namespace {

void require(bool condition, const char* name, double value, const char* expected) {
  if (!condition)
    throw std::invalid_argument(std::string("state variable filter: ") + name + " = " +
                                std::to_string(value) + ", expected " + expected);
}

}  // namespace

StateVariableFilter::StateVariableFilter(const Config& config) {
  const double w = config.cutoff_rad_per_s;
  const double zeta = config.damping;
  const double T = config.period_s;
  require(std::isfinite(T) && T > 0, "period_s", T, "a positive time");
  require(std::isfinite(w) && w > 0 && w * T <= 1, "cutoff_rad_per_s", w, "between 0 and 1/period");
  require(zeta >= 0.1 && zeta <= 10, "damping", zeta, "between 0.1 and 10");
  period_s_ = T;
  lag_s_ = 2 * zeta / w;
  stiffness_ = w * w;
  friction_ = 2 * zeta * w;

  // Matrix exponential of [[0, 1], [-w², -2ζw]] by its closed form: with a = ζw and d = sqrt(a² - w²),
  // exp(AT) = e^(-aT) (cosh(dT) I + sinh(dT)/d (A + a I)); complex d covers ζ < 1, the limit sinh(dT)/d -> T
  // covers ζ = 1.
  const double a = zeta * w;
  const std::complex<double> d = std::sqrt(std::complex<double>(a * a - w * w));
  const double cosh_dT = std::cosh(d * T).real();
  const double sinh_dT_over_d = std::abs(d * T) < 1e-6 ? T : (std::sinh(d * T) / d).real();
  Eigen::Matrix2d A_shifted;
  A_shifted << a, 1, -w * w, a - friction_;
  transition_ = std::exp(-a * T) * (cosh_dT * Eigen::Matrix2d::Identity() + sinh_dT_over_d * A_shifted);
}

StateVariableFilter::Output StateVariableFilter::step(double position) noexcept {
  if (!started_) reset(position);
  // Along a straight input of slope r the filter settles on (u − r·2ζ/ω, r); what is off it decays by Φ.
  const double slope = (position - last_input_) / period_s_;
  const Eigen::Vector2d settled_before(last_input_ - lag_s_ * slope, slope);
  const Eigen::Vector2d settled_now(position - lag_s_ * slope, slope);
  state_ = settled_now + transition_ * (state_ - settled_before);
  last_input_ = position;
  return {state_[0], state_[1], stiffness_ * (position - state_[0]) - friction_ * state_[1]};
}

}  // namespace control
