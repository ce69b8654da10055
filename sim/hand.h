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

  void hold_at(const Eigen::Vector3d& p_HD_m) noexcept {
    intended_p_HD_m_ = p_HD_m;
    holding_ = true;
  }
  void let_go() noexcept { holding_ = false; }

  void measure(hal::HapticSample& sample) noexcept override;
  void advance(const Eigen::Vector3d& f_D_H_N, std::chrono::nanoseconds duration) noexcept override;

 private:
  HandParameters parameters_;
  bool holding_ = true;
  Eigen::Vector3d intended_p_HD_m_ = Eigen::Vector3d::Zero();
  Eigen::Vector3d p_HD_m_ = Eigen::Vector3d::Zero();
  Eigen::Vector3d v_HD_H_m_per_s_ = Eigen::Vector3d::Zero();
};

}  // namespace sim
