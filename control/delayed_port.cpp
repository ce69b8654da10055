#include "control/delayed_port.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>

namespace control {
namespace {

/// Of a force [N²]: below, it carries no energy.
constexpr double kSmallestSquare = 1e-12;

PortLedger empty_ledger(const DelayedPortConfig& config) { return {config.tank.reserve_J, config.surplus_J}; }

const DelayedPortConfig& checked_port(const DelayedPortConfig& config) {
  (void)EnergyTank(config.tank);  // checks its own
  if (!(std::isfinite(config.surplus_J) && config.surplus_J >= 0))
    throw std::invalid_argument("delayed port: surplus_J = " + std::to_string(config.surplus_J) +
                                " is out of range");
  return config;
}

}  // namespace

HandPort::HandPort(const DelayedPortConfig& config)
    : config_(checked_port(config)), ledger_(empty_ledger(config)) {}

void HandPort::reset() noexcept {
  ledger_ = empty_ledger(config_);
  has_sample_ = false;
  withheld_N_ = 0;
}

Eigen::Vector3d HandPort::step(const Eigen::Vector3d& p_m, const Eigen::Vector3d& v_m_per_s,
                               const Eigen::Vector3d& held_N, const Eigen::Vector3d& wanted_N,
                               double robot_in_J) noexcept {
  if (has_sample_) ledger_.count(held_N.dot(p_m - p_m_));
  has_sample_ = true;
  p_m_ = p_m;
  const double level_J = ledger_.level_J(robot_in_J);
  withheld_N_ = 0;
  if (!config_.active) return wanted_N;
  const LimitedForce limited = limited_by_energy(config_.tank, level_J, v_m_per_s, wanted_N);
  withheld_N_ = limited.withheld_N;
  return limited.force_N;
}

RobotPort::RobotPort(const DelayedPortConfig& config)
    : config_(checked_port(config)), ledger_(empty_ledger(config)) {}

void RobotPort::reset() noexcept {
  ledger_ = empty_ledger(config_);
  has_position_ = false;
}

Eigen::Vector3d RobotPort::step(const Eigen::Vector3d& received_m, const Eigen::Vector3d& held_N,
                                double hand_in_J, double most_m) noexcept {
  if (!has_position_) {
    has_position_ = true;
    return p_m_ = received_m;
  }
  Eigen::Vector3d way_m = received_m - p_m_;
  if (const double length_m = way_m.norm(); length_m > most_m) way_m *= most_m / length_m;
  const double level_J = ledger_.level_J(hand_in_J);
  const double leaving_J = -held_N.dot(way_m);
  const double allowed_J = std::max(0.0, level_J);
  if (config_.active && leaving_J > allowed_J && held_N.squaredNorm() > kSmallestSquare)
    way_m += held_N * ((leaving_J - allowed_J) / held_N.squaredNorm());
  ledger_.count(-held_N.dot(way_m));
  return p_m_ += way_m;
}

}  // namespace control
