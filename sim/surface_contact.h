/// @file
/// Contact of two bodies at one point: a normal force that only pushes, and friction.
///
/// N = k·δ·(1 + 3/2·α·dδ/dt), never below zero: K. H. Hunt, F. R. E. Crossley, J. Applied Mechanics 42:440,
/// 1975. A body that arrives with v leaves with about (1 − α·v)·v, whatever its mass; the loss never exceeds
/// the incoming energy. Friction is sim/bounded_bristle.h in the plane of contact with the bound µ·N: it
/// holds without creep within its cone and slides on it.
#pragma once
#include <Eigen/Core>
#include <algorithm>

namespace sim {

struct Surface {
  double stiffness_N_per_m = 2e4;  ///< k, normal and tangential alike; default: wood under a rubber finger
  double loss_s_per_m = 1.0;       ///< α
  double friction = 0.3;           ///< µ
};

/// One thread. Cycle: step() is pure arithmetic.
class SurfaceContact {
 public:
  explicit SurfaceContact(const Surface& surface) noexcept : surface_(surface) {}

  /// Force on the body that moves with `v_m_per_s` against the surface and penetrates it by `depth_m`
  /// (negative: separated); `normal` points out of the surface.
  Eigen::Vector3d step(double depth_m, const Eigen::Vector3d& normal, const Eigen::Vector3d& v_m_per_s,
                       double step_s) noexcept {
    if (depth_m <= 0) {
      shear_m_.setZero();
      return Eigen::Vector3d::Zero();
    }
    const double closing_m_per_s = -normal.dot(v_m_per_s);
    const double press_N = std::max(
        0.0, surface_.stiffness_N_per_m * depth_m * (1 + 1.5 * surface_.loss_s_per_m * closing_m_per_s));
    const Eigen::Vector3d sliding_m_per_s = v_m_per_s + closing_m_per_s * normal;
    const double bound_N = surface_.friction * press_N;
    shear_m_ += step_s * sliding_m_per_s;
    shear_m_ -= normal.dot(shear_m_) * normal;  // at an edge the plane of contact turns
    shear_m_ = no_longer_than(bound_N / surface_.stiffness_N_per_m, shear_m_);
    const Eigen::Vector3d drag_N =
        no_longer_than(bound_N, surface_.stiffness_N_per_m * (shear_m_ + kRelaxation_s * sliding_m_per_s));
    return press_N * normal - drag_N;
  }

 private:
  /// Of the damper parallel to the tangential spring; assumption, so that sticking does not ring.
  static constexpr double kRelaxation_s = 1e-3;

  static Eigen::Vector3d no_longer_than(double length, const Eigen::Vector3d& v) noexcept {
    const double norm = v.norm();
    return norm > length ? Eigen::Vector3d(length / norm * v) : v;
  }

  Surface surface_;
  Eigen::Vector3d shear_m_ = Eigen::Vector3d::Zero();
};

}  // namespace sim
