#include "sim/hand.h"

#include <cmath>

namespace sim {
namespace {
/// Far below the hand's own period of about 0.3 s.
constexpr double kLargestStep_s = 1e-4;
}  // namespace

void Hand::move_to(const Eigen::Vector3d& p_HD_m, std::chrono::nanoseconds duration) noexcept {
  from_p_HD_m_ = holding_ ? intended_p_HD_m() : p_HD_m_;
  to_p_HD_m_ = p_HD_m;
  reach_s_ = std::chrono::duration<double>(duration).count();
  reached_s_ = 0.0;
  holding_ = true;
}

Eigen::Vector3d Hand::intended_p_HD_m() const noexcept {
  if (reached_s_ >= reach_s_) return to_p_HD_m_;
  const double t = reached_s_ / reach_s_;
  const double share = t * t * t * (10.0 + t * (6.0 * t - 15.0));
  return from_p_HD_m_ + share * (to_p_HD_m_ - from_p_HD_m_);
}

void Hand::measure(hal::HapticSample& sample) noexcept {
  sample.p_HD_m = p_HD_m_;
  sample.v_HD_H_m_per_s = v_HD_H_m_per_s_;
}

void Hand::advance(const Eigen::Vector3d& f_D_H_N, std::chrono::nanoseconds duration) noexcept {
  const HandParameters& p = parameters_;
  const double mass_kg = p.device_mass_kg + (holding_ ? p.hand_mass_kg : 0.0);
  const double duration_s = std::chrono::duration<double>(duration).count();
  const double steps = std::ceil(duration_s / kLargestStep_s);
  const double step_s = duration_s / steps;
  for (double n = 0; n < steps; ++n) {
    reached_s_ += step_s;
    Eigen::Vector3d force_N = f_D_H_N + push_N_ - p.device_drag_N_s_per_m * v_HD_H_m_per_s_;
    if (holding_)
      force_N += p.hand_stiffness_N_per_m * (intended_p_HD_m() - p_HD_m_) -
                 p.hand_damping_N_s_per_m * v_HD_H_m_per_s_;
    v_HD_H_m_per_s_ += step_s / mass_kg * force_N;
    p_HD_m_ += step_s * v_HD_H_m_per_s_;
  }
}

}  // namespace sim
