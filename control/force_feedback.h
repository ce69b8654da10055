/// @file
/// Force on the hand from the spring between set-point and end effector (thesis 3.4.1: position-error force
/// feedback), from the estimated contact force (position-force feedback), or from both.
#pragma once
#include <Eigen/Core>

#include "control/master_frame.h"

namespace control {

/// The spring that pulls the end effector to the set-point also pulls the handle to the end effector: f_H =
/// −R_HW·f_W/k_f, limited in magnitude. What the environment does to the end effector is a share c of it:
/// f_W = (1 − c)·f_spring − c·f_contact. Cycle: pure.
struct ForceFeedback {
  double force_scale = 10.0;   ///< k_f, force on the end effector over force on the hand
  double force_limit_N = 8.0;  ///< on the hand
  double contact_share = 0.0;  ///< c, 0 to 1

  /// f_W. At rest both parts are equal but for the friction that the spring overcomes.
  Eigen::Vector3d felt_W_N(const Eigen::Vector3d& spring_W_N,
                           const Eigen::Vector3d& contact_W_N) const noexcept {
    if (contact_share == 0) return spring_W_N;
    return (1 - contact_share) * spring_W_N - contact_share * contact_W_N;
  }

  /// `force_W_N`: f_W.
  Eigen::Vector3d force_H_N(const Eigen::Vector3d& force_W_N) const noexcept {
    const Eigen::Vector3d force_H_N = -turned_H_W(force_W_N) / force_scale;
    const double magnitude_N = force_H_N.norm();
    return magnitude_N > force_limit_N ? Eigen::Vector3d(force_limit_N / magnitude_N * force_H_N) : force_H_N;
  }

  /// Energy that the spring, stretched by `stretch_m` at the end effector, returns to a hand that yields,
  /// with the force limit. `motion_scale`: displacement of the end effector over that of the hand.
  double stored_J(double stretch_m, double stiffness_N_per_m, double motion_scale) const noexcept {
    if (!(stiffness_N_per_m > 0)) return 0.0;
    const double hand_stiffness_N_per_m = stiffness_N_per_m * motion_scale / force_scale;
    const double way_m = stretch_m / motion_scale;
    const double limited_from_m = force_limit_N / hand_stiffness_N_per_m;
    return way_m <= limited_from_m ? hand_stiffness_N_per_m * way_m * way_m / 2
                                   : force_limit_N * (way_m - limited_from_m / 2);
  }
};

}  // namespace control
