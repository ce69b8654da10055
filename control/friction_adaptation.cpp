#include "control/friction_adaptation.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>
#include <utility>

namespace control {
namespace {

bool slides(const FrictionEstimate& estimate) noexcept { return estimate.rest <= 0; }
bool rests(const FrictionEstimate& estimate) noexcept { return estimate.rest > 0.5; }

}  // namespace

FrictionAdaptation::FrictionAdaptation(const Config& config, const LinkMap& map,
                                       const std::array<double, 4>& start)
    : config_(config), map_(map), factor_(start) {
  const auto require = [](bool condition, const std::string& what) {
    if (!condition) throw std::invalid_argument("friction adaptation: " + what);
  };
  require(config.inertia.allFinite() && (config.inertia.array() > 0).all(), "inertia must be positive");
  require(config.least > 0 && config.least <= 1 && config.greatest >= 1,
          "the factors must be positive, the least at most and the greatest at least 1");
  require(
      config.observer_s > 0 && config.learning_s > 0 && config.rise_per_s >= 0 && config.full_command_Nm > 0,
      "times and full_command_Nm must be positive");
  require(std::ranges::all_of(start, [&](double f) { return f >= config.least && f <= config.greatest; }),
          "each factor must begin between the least and the greatest");
}

double FrictionAdaptation::bounded(double factor) const noexcept {
  return std::clamp(factor, config_.least, config_.greatest);
}

std::array<double, 4> FrictionAdaptation::factors() const noexcept {
  std::array<double, 4> now = factor_;
  for (double& factor : now) factor = bounded(factor + rise_);
  return now;
}

void FrictionAdaptation::forget_motion() noexcept {
  started_ = false;
  rise_ = 0;
  blocked_ = false;
  sliding_s_ = 0;
}

void FrictionAdaptation::step(const WheelVector& torque_Nm, const WheelVector& command_Nm,
                              const std::array<FrictionEstimate, 4>& estimates, const PlanarVector& twist_B,
                              double elapsed_s) noexcept {
  if (elapsed_s == 0) return;
  // Written so that NaN restarts.
  if (!(elapsed_s > 0 && elapsed_s < config_.observer_s / 2 && torque_Nm.allFinite() && twist_B.allFinite()))
    return forget_motion();
  observe(torque_Nm, estimates, twist_B, elapsed_s);
  sliding_s_ = std::ranges::all_of(estimates, slides) ? sliding_s_ + elapsed_s : 0;
  // Then the observer has forgotten what the wheels held at rest.
  if (sliding_s_ > config_.observer_s)
    learn(estimates, elapsed_s);
  else if (std::ranges::all_of(estimates, rests))
    rise(command_Nm, elapsed_s);
}

void FrictionAdaptation::observe(const WheelVector& torque_Nm,
                                 const std::array<FrictionEstimate, 4>& estimates,
                                 const PlanarVector& twist_B, double elapsed_s) noexcept {
  const PlanarVector now = config_.inertia.cwiseProduct(twist_B);
  if (!std::exchange(started_, true)) {
    momentum_ = now;
    unexplained_B_.setZero();
    return;
  }
  WheelVector net_Nm = torque_Nm;
  for (std::size_t i = 0; i < 4; ++i)
    net_Nm[static_cast<Eigen::Index>(i)] -= factor_[i] * estimates[i].friction_Nm + estimates[i].position_Nm;
  PlanarVector wrench_B = map_.wrench(net_Nm);
  // Newton in the rotating frame B: m·(dv/dt + ω × v) = f.
  wrench_B[0] += twist_B[2] * now[1];
  wrench_B[1] -= twist_B[2] * now[0];
  momentum_ += elapsed_s * (wrench_B + unexplained_B_);
  unexplained_B_ = (now - momentum_) / config_.observer_s;
}

void FrictionAdaptation::learn(const std::array<FrictionEstimate, 4>& estimates, double elapsed_s) noexcept {
  const double rise = std::exchange(rise_, 0.0);
  blocked_ = false;
  const WheelVector unexplained_Nm = map_.wheel_torque(unexplained_B_);
  const double share = std::min(1.0, elapsed_s / config_.learning_s);
  for (std::size_t i = 0; i < 4; ++i) {
    const double change = -unexplained_Nm[static_cast<Eigen::Index>(i)] / estimates[i].friction_Nm;
    if (std::isfinite(change)) factor_[i] = bounded(factor_[i] + rise + share * change);
  }
}

void FrictionAdaptation::rise(const WheelVector& command_Nm, double elapsed_s) noexcept {
  const bool wanted = command_Nm.cwiseAbs().maxCoeff() >= config_.full_command_Nm;
  const double room = config_.greatest - *std::ranges::min_element(factor_);
  blocked_ = wanted && (blocked_ || rise_ >= room);
  const double by = (wanted && !blocked_ ? 1 : -1) * config_.rise_per_s * elapsed_s;
  rise_ = std::clamp(rise_ + by, 0.0, room);
}

}  // namespace control
