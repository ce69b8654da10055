/// @file
/// An operator's hand on a haptic master.
#pragma once
#include <Eigen/Core>
#include <chrono>

#include "hal/hand_plant.h"

namespace sim {

/// The hand pulls the grip to where it means to be with a spring and a damper; let go, only the device's own
/// mass and drag remain. Values for an arm at ease holding a pen; the device is gravity compensated.
struct HandParameters {
  double device_mass_kg = 0.3;
  double device_drag_N_s_per_m = 0.5;
  double hand_mass_kg = 0.5;
  double hand_stiffness_N_per_m = 300.0;
  double hand_damping_N_s_per_m = 12.0;
};

/// One thread. Cycle: measure(), advance().
class Hand final : public hal::HandPlant {
 public:
  explicit Hand(const HandParameters& parameters) : parameters_(parameters) {}

  void hold_at(const Eigen::Vector3d& p_HD_m) noexcept { move_to(p_HD_m, {}); }
  /// Reaches for a place: where the hand means to be goes there in this time, on a straight line and with the
  /// least jerk, as people's hands do (Flash and Hogan, J. Neuroscience 5:1688, 1985).
  void move_to(const Eigen::Vector3d& p_HD_m, std::chrono::nanoseconds duration) noexcept;
  void let_go() noexcept { holding_ = false; }
  bool holds() const noexcept { return holding_; }
  /// On top of the above, until it is changed: a shove, or somebody else's hand.
  void push(const Eigen::Vector3d& force_N) noexcept { push_N_ = force_N; }

  void measure(hal::HapticSample& sample) noexcept override;
  void advance(const Eigen::Vector3d& f_D_H_N, std::chrono::nanoseconds duration) noexcept override;

 private:
  Eigen::Vector3d intended_p_HD_m() const noexcept;

  HandParameters parameters_;
  bool holding_ = true;
  Eigen::Vector3d push_N_ = Eigen::Vector3d::Zero();
  // Where it means to be: from one place to the other, as far as `reached_s_` of `reach_s_`.
  Eigen::Vector3d from_p_HD_m_ = Eigen::Vector3d::Zero();
  Eigen::Vector3d to_p_HD_m_ = Eigen::Vector3d::Zero();
  double reach_s_ = 0.0;
  double reached_s_ = 0.0;
  Eigen::Vector3d p_HD_m_ = Eigen::Vector3d::Zero();
  Eigen::Vector3d v_HD_H_m_per_s_ = Eigen::Vector3d::Zero();
};

}  // namespace sim
