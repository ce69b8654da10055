#include "sim/hand.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>

#include "hal/seconds.h"

namespace sim {
namespace {

using hal::seconds;

/// Far below the hand's own period of about 0.3 s, and below the 30 ms of the handle at its end stop.
constexpr double kLargestStep_s = 1e-4;

void check(const char* name, double value, bool may_be_zero) {
  if (std::isfinite(value) && (value > 0.0 || (may_be_zero && value == 0.0))) return;
  throw std::invalid_argument(std::string("hand: ") + name + " is " + std::to_string(value) + ", must be " +
                              (may_be_zero ? "finite and not negative" : "finite and positive"));
}

/// Completed share of a minimum-jerk movement after `reached_s` of `reach_s`.
double least_jerk(double reached_s, double reach_s) {
  if (reached_s >= reach_s) return 1.0;
  const double t = reached_s / reach_s;
  return t * t * t * (10.0 + t * (6.0 * t - 15.0));
}

}  // namespace

Hand::Hand(const HandParameters& parameters) : parameters_(parameters) {
  check("device_mass_kg", parameters.device_mass_kg, false);
  check("device_drag_N_s_per_m", parameters.device_drag_N_s_per_m, true);
  check("hand_mass_kg", parameters.hand_mass_kg, true);
  check("hand_stiffness_N_per_m", parameters.hand_stiffness_N_per_m, true);
  check("hand_damping_N_s_per_m", parameters.hand_damping_N_s_per_m, true);
  if (!parameters.travel) return;
  const GripTravel& travel = *parameters.travel;
  for (int axis = 0; axis < 3; ++axis) check("semi_axes_m of its travel", travel.semi_axes_m[axis], false);
  check("stiffness_N_per_m of its end stops", travel.stiffness_N_per_m, false);
  check("damping_N_s_per_m of its end stops", travel.damping_N_s_per_m, true);
  const bool finite = travel.centre_H_m.allFinite() && std::isfinite(travel.lowest_x_m + travel.lowest_z_m);
  if (!finite) throw std::invalid_argument("hand: centre or planes of its travel are not finite");
}

void Hand::move_to(const Eigen::Vector3d& p_HD_m, std::chrono::nanoseconds duration) noexcept {
  take_hold();
  from_p_HD_m_ = intended_p_HD_m();
  to_p_HD_m_ = p_HD_m;
  reach_s_ = seconds(duration);
  reached_s_ = 0.0;
}

void Hand::turn_to(const Eigen::Quaterniond& q_HD, std::chrono::nanoseconds duration) noexcept {
  take_hold();
  turn(q_HD, duration);
}

void Hand::let_go() noexcept {
  if (holding_) turn(q_HD(), {});
  holding_ = false;
}

void Hand::take_hold() noexcept {
  if (holding_) return;
  turn(q_HD(), {});
  to_p_HD_m_ = p_HD_m_;
  reach_s_ = 0.0;
  holding_ = true;
}

void Hand::flip(const Eigen::Quaterniond& q_HD, std::chrono::nanoseconds duration) noexcept {
  if (!holding_) turn(q_HD, duration);
}

void Hand::turn(const Eigen::Quaterniond& to, std::chrono::nanoseconds duration) noexcept {
  from_q_HD_ = q_HD();
  to_q_HD_ = to;
  turn_s_ = seconds(duration);
  turned_s_ = 0.0;
}

Eigen::Vector3d Hand::intended_p_HD_m() const noexcept {
  return from_p_HD_m_ + least_jerk(reached_s_, reach_s_) * (to_p_HD_m_ - from_p_HD_m_);
}

Eigen::Quaterniond Hand::q_HD() const noexcept {
  return from_q_HD_.slerp(least_jerk(turned_s_, turn_s_), to_q_HD_);
}

Eigen::Vector3d Hand::stop_force_N() const noexcept {
  Eigen::Vector3d force_N = Eigen::Vector3d::Zero();
  if (!parameters_.travel) return force_N;
  const GripTravel& travel = *parameters_.travel;
  const auto stop = [&](const Eigen::Vector3d& outward, double beyond_m) {
    if (beyond_m <= 0.0) return;
    const double out_N =
        travel.stiffness_N_per_m * beyond_m + travel.damping_N_s_per_m * outward.dot(v_HD_H_m_per_s_);
    force_N -= std::max(0.0, out_N) * outward;
  };
  stop(-Eigen::Vector3d::UnitX(), travel.lowest_x_m - p_HD_m_.x());
  stop(-Eigen::Vector3d::UnitZ(), travel.lowest_z_m - p_HD_m_.z());
  // First-order distance from the spheroid: (|u| - 1) over its gradient, with u the position in semi-axes.
  const Eigen::Vector3d u = (p_HD_m_ - travel.centre_H_m).cwiseQuotient(travel.semi_axes_m);
  const double radius = u.norm();
  if (radius > 1.0) {
    const Eigen::Vector3d gradient_per_m = u.cwiseQuotient(travel.semi_axes_m) / radius;
    stop(gradient_per_m.normalized(), (radius - 1.0) / gradient_per_m.norm());
  }
  return force_N;
}

void Hand::measure(hal::HapticSample& sample) noexcept {
  sample.p_HD_m = p_HD_m_;
  sample.v_HD_H_m_per_s = v_HD_H_m_per_s_;
  sample.q_HD = q_HD();
  sample.buttons = buttons_;
}

void Hand::advance(const Eigen::Vector3d& f_D_H_N, std::chrono::nanoseconds duration) noexcept {
  const HandParameters& p = parameters_;
  const double hand_mass_kg = holding_ ? p.hand_mass_kg : 0.0;
  const double duration_s = seconds(duration);
  const double steps = std::ceil(duration_s / kLargestStep_s);
  const double step_s = duration_s / steps;
  f_D_H_N_ = f_D_H_N;
  if (steps > 0) grip_force_N_.setZero();
  for (double n = 0; n < steps; ++n) {
    reached_s_ += step_s;
    turned_s_ += step_s;
    Eigen::Vector3d arm_N = push_N_;
    if (holding_)
      arm_N += p.hand_stiffness_N_per_m * (intended_p_HD_m() - p_HD_m_) -
               p.hand_damping_N_s_per_m * v_HD_H_m_per_s_;
    const Eigen::Vector3d device_N = f_D_H_N + stop_force_N() - p.device_drag_N_s_per_m * v_HD_H_m_per_s_;
    const Eigen::Vector3d a_m_per_s2 = (arm_N + device_N) / (p.device_mass_kg + hand_mass_kg);
    grip_force_N_ += (arm_N - hand_mass_kg * a_m_per_s2) / steps;
    v_HD_H_m_per_s_ += step_s * a_m_per_s2;
    p_HD_m_ += step_s * v_HD_H_m_per_s_;
  }
}

}  // namespace sim
