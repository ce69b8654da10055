#include "control/friction_adaptation.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>
#include <utility>

namespace control {
namespace {

bool slides(const FrictionEstimate& estimate) noexcept { return estimate.rest <= 0; }

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
  require(config.observer_s > 0 && config.learning_s > 0 && config.breakaway_per_s >= 0 &&
              config.full_command_Nm > 0,
          "times and full_command_Nm must be positive");
  require(std::ranges::all_of(start, [&](double f) { return f >= config.least && f <= config.greatest; }),
          "each factor must begin between the least and the greatest");
}

void FrictionAdaptation::step(const WheelVector& torque_Nm, const WheelVector& command_Nm,
                              const std::array<FrictionEstimate, 4>& estimates, const PlanarVector& twist_B,
                              double elapsed_s) noexcept {
  if (!(elapsed_s > 0)) return;
  observe(torque_Nm, estimates, twist_B, elapsed_s);
  if (std::ranges::all_of(estimates, slides)) learn(estimates, elapsed_s);
  rise(command_Nm, estimates, elapsed_s);
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
  const WheelVector unexplained_Nm = map_.wheel_torque(unexplained_B_);
  const double share = std::min(1.0, elapsed_s / config_.learning_s);
  for (std::size_t i = 0; i < 4; ++i) {
    const double change = -unexplained_Nm[static_cast<Eigen::Index>(i)] / estimates[i].friction_Nm;
    if (std::isfinite(change))
      factor_[i] = std::clamp(factor_[i] + share * change, config_.least, config_.greatest);
  }
}

void FrictionAdaptation::rise(const WheelVector& command_Nm, const std::array<FrictionEstimate, 4>& estimates,
                              double elapsed_s) noexcept {
  for (std::size_t i = 0; i < 4; ++i) {
    const bool wanted = std::abs(command_Nm[static_cast<Eigen::Index>(i)]) >= config_.full_command_Nm;
    if (slides(estimates[i])) {
      factor_[i] = std::min(factor_[i] + std::exchange(rise_[i], 0.0), config_.greatest);
    } else if (estimates[i].rest > 0.5) {
      rise_[i] += (wanted ? 1 : -1) * config_.breakaway_per_s * elapsed_s;
      rise_[i] = std::clamp(rise_[i], 0.0, config_.greatest - factor_[i]);
    }
  }
}

}  // namespace control
