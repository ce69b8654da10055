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
  transition_ = transition_over(T);
}

/// Closed-form matrix exponential of [[0, 1], [-w², -2ζw]]: with a = ζw and d = sqrt(a² - w²), exp(At) =
/// e^(-at) (cosh(dt) I + sinh(dt)/d (A + a I)); complex d covers ζ < 1, the limit sinh(dt)/d -> t covers ζ =
/// 1. Both factors are moved into the brackets, where nothing grows with a long time.
Eigen::Matrix2d StateVariableFilter::transition_over(double time_s) const noexcept {
  const double a = friction_ / 2;
  const std::complex<double> d = std::sqrt(std::complex<double>(a * a - stiffness_));
  const std::complex<double> slow = std::exp((d - a) * time_s);
  const std::complex<double> fast = std::exp(-(d + a) * time_s);
  const double damped_cosh = (slow + fast).real() / 2;
  const double damped_sinh_over_d =
      std::abs(d * time_s) < 1e-6 ? time_s * std::exp(-a * time_s) : ((slow - fast) / (2.0 * d)).real();
  Eigen::Matrix2d A_shifted;
  A_shifted << a, 1, -stiffness_, -a;
  return damped_cosh * Eigen::Matrix2d::Identity() + damped_sinh_over_d * A_shifted;
}

StateVariableFilter::Output StateVariableFilter::step(double position,
                                                      std::optional<double> elapsed_s) noexcept {
  if (!started_) reset(position);
  if (const double time_s = elapsed_s.value_or(period_s_); time_s > 0) follow(position, time_s);
  return {state_[0], state_[1], stiffness_ * (last_input_ - state_[0]) - friction_ * state_[1]};
}

void StateVariableFilter::follow(double position, double elapsed_s) noexcept {
  // For an input of slope r the filter settles on (u − r·2ζ/ω, r); the deviation decays by Φ.
  const double slope = (position - last_input_) / elapsed_s;
  const Eigen::Vector2d settled_before(last_input_ - lag_s_ * slope, slope);
  const Eigen::Vector2d settled_now(position - lag_s_ * slope, slope);
  const Eigen::Vector2d off = state_ - settled_before;
  state_ = settled_now + (elapsed_s == period_s_ ? transition_ : transition_over(elapsed_s)) * off;
  last_input_ = position;
}

}  // namespace control
