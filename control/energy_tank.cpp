#include "control/energy_tank.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>

namespace control {
namespace {

/// Share of the reserve that a force passed by an empty tank may deliver while it is removed.
constexpr double kAgainstShare = 0.2;

void require(bool good, const char* name, double value) {
  if (!good)
    throw std::invalid_argument(std::string("energy tank: ") + name + " = " + std::to_string(value) +
                                " is out of range");
}

/// Maximum force whose removal delivers at most this energy.
double brakeable_N(const EnergyTank::Config& config, double energy_J, double along_m_per_s) noexcept {
  // Half of the energy for each of the two terms.
  const double half_J = std::max(0.0, energy_J) / 2;
  const double R = config.force_rate_N_per_s;
  const double by_speed_N = std::sqrt(2 * R * half_J / std::max(along_m_per_s, 1e-6));
  const double by_mass_N = std::sqrt(std::sqrt(8 * config.device_mass_kg * R * R * half_J));
  return std::min(by_speed_N, by_mass_N);
}

}  // namespace

EnergyTank::EnergyTank(const Config& config) : config_(config), level_J_(config.reserve_J) {
  require(std::isfinite(config.reserve_J) && config.reserve_J > 0, "reserve_J", config.reserve_J);
  require(std::isfinite(config.damping_N_s_per_m) && config.damping_N_s_per_m >= 0, "damping_N_s_per_m",
          config.damping_N_s_per_m);
  require(config.force_rate_N_per_s > 0, "force_rate_N_per_s", config.force_rate_N_per_s);
  require(config.device_mass_kg > 0, "device_mass_kg", config.device_mass_kg);
  require(config.against_speed_m_per_s > 0, "against_speed_m_per_s", config.against_speed_m_per_s);
}

void EnergyTank::reset() noexcept {
  has_sample_ = false;
  damper_N_.setZero();
  level_J_ = config_.reserve_J;
}

EnergyTank::Output EnergyTank::step(const Eigen::Vector3d& p_m, const Eigen::Vector3d& v_m_per_s,
                                    const Eigen::Vector3d& held_N, const Eigen::Vector3d& wanted_N,
                                    double stored_J) noexcept {
  if (has_sample_) {
    const Eigen::Vector3d way_m = p_m - p_m_;
    const double given_J = held_N.dot(way_m);
    // Part of the removed energy that the damper absorbed, limited to the force that the device held.
    level_J_ -= given_J + std::clamp(-damper_N_.dot(way_m), 0.0, std::max(0.0, -given_J));
  }
  level_J_ = std::min(level_J_, stored_J + config_.reserve_J);
  has_sample_ = true;
  p_m_ = p_m;
  damper_N_.setZero();
  if (!config_.active) return {wanted_N, 0.0};

  const LimitedForce limited = limited_by_energy(config_, level_J_, v_m_per_s, wanted_N);
  damper_N_ = limited.damper_N;
  return {limited.force_N, limited.withheld_N};
}

LimitedForce limited_by_energy(const EnergyTank::Config& config, double level_J,
                               const Eigen::Vector3d& v_m_per_s, const Eigen::Vector3d& wanted_N) noexcept {
  const double magnitude_N = wanted_N.norm();
  const double along_m_per_s = magnitude_N > 0 ? wanted_N.dot(v_m_per_s) / magnitude_N : 0.0;
  // After delivering more than the tank held, less and less force passes against the motion: none once the
  // deficit reaches the reserve.
  const double against = std::clamp(-along_m_per_s / config.against_speed_m_per_s, 0.0, 1.0) *
                         std::clamp(1 + level_J / config.reserve_J, 0.0, 1.0);
  const double full = std::clamp(level_J / (config.reserve_J / 2), 0.0, 1.0);
  const double given_N =
      full * std::min(magnitude_N, brakeable_N(config, level_J, along_m_per_s)) +
      (1 - full) * against *
          std::min(magnitude_N, brakeable_N(config, kAgainstShare * config.reserve_J, 0.0));
  const double share = magnitude_N > 0 ? given_N / magnitude_N : 0.0;
  const Eigen::Vector3d damper_N = -(1 - full) * config.damping_N_s_per_m * v_m_per_s;
  return {share * wanted_N + damper_N, damper_N, magnitude_N - given_N};
}

}  // namespace control
