/// @file
/// Energy that a haptic device delivers to the hand.
#pragma once
#include <Eigen/Core>

namespace control {

/// Sum of force times displacement. The force is held between samples, as in the device, so that the sum is
/// exact. Positive: delivered to the hand. One thread. Cycle: everything.
class PortEnergy {
 public:
  /// At each sample: position of the handle, and the force from now on.
  void update(const Eigen::Vector3d& p_m, const Eigen::Vector3d& force_N) noexcept {
    if (has_sample_) energy_J_ += force_N_.dot(p_m - p_m_);
    has_sample_ = true;
    p_m_ = p_m;
    force_N_ = force_N;
  }
  double energy_J() const noexcept { return energy_J_; }

 private:
  bool has_sample_ = false;
  Eigen::Vector3d p_m_ = Eigen::Vector3d::Zero();
  Eigen::Vector3d force_N_ = Eigen::Vector3d::Zero();
  double energy_J_ = 0.0;
};

}  // namespace control
