#include "control/hand_presence.h"

#include <cmath>
#include <stdexcept>
#include <string>

#include "control/positive.h"

namespace control {
HandPresence::HandPresence(const Config& config) : config_(config) {
  const RequirePositive require_positive{"hand presence"};
  require_positive(config.period_s, "period_s");
  require_positive(config.device_mass_kg, "device_mass_kg");
  require_positive(config.bandwidth_rad_per_s, "bandwidth_rad_per_s");
  require_positive(config.telling_force_N, "telling_force_N");
  require_positive(config.released_share, "released_share");
  require_positive(config.released_impulse_N_s, "released_impulse_N_s");
  require_positive(config.felt_hand_N, "felt_hand_N");
  require_positive(config.unfelt_after_s, "unfelt_after_s");
  if (!(config.device_drag_N_s_per_m >= 0))
    throw std::invalid_argument("hand presence: device_drag_N_s_per_m must not be negative");
}

void HandPresence::reset() noexcept {
  expected_N_s_.setZero();
  hand_N_.setZero();
  device_N_.setZero();
  unopposed_N_s_ = unfelt_s_ = 0;
  present_ = true;
}

bool HandPresence::step(const Eigen::Vector3d& v_m_per_s, const Eigen::Vector3d& held_N,
                        double withheld_N) noexcept {
  const double share = 1 - std::exp(-config_.bandwidth_rad_per_s * config_.period_s);
  expected_N_s_ += config_.period_s * (held_N - config_.device_drag_N_s_per_m * v_m_per_s + hand_N_);
  hand_N_ = config_.bandwidth_rad_per_s * (config_.device_mass_kg * v_m_per_s - expected_N_s_);
  device_N_ += share * (held_N - device_N_);

  const double device_N = device_N_.norm();
  const bool telling = device_N > config_.telling_force_N;
  const bool alone = telling && hand_N_.norm() < config_.released_share * device_N;
  unopposed_N_s_ = alone ? unopposed_N_s_ + config_.period_s * device_N : 0.0;
  const bool unfelt = withheld_N > config_.telling_force_N && hand_N_.norm() < config_.felt_hand_N;
  unfelt_s_ = unfelt ? unfelt_s_ + config_.period_s : 0.0;
  if (unopposed_N_s_ >= config_.released_impulse_N_s || unfelt_s_ >= config_.unfelt_after_s) present_ = false;
  return present_;
}

}  // namespace control
