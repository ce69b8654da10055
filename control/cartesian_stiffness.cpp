#include "control/cartesian_stiffness.h"

#include <Eigen/Eigenvalues>
#include <cmath>
#include <stdexcept>
#include <string>

#include "control/positive.h"

namespace control {
namespace {

/// Shortens to the limit; returns true if it did. NaN stays NaN.
bool shorten(Eigen::Vector3d& vector, double limit) noexcept {
  const double length = vector.norm();
  if (!(length > limit)) return false;
  vector *= limit / length;
  return true;
}

/// Λ^½·v, for Λ⁻¹ = `mobility`.
Eigen::Vector3d by_root_of_inertia(const Eigen::Matrix3d& mobility, double max_inertia,
                                   const Eigen::Vector3d& velocity) noexcept {
  Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> axes;
  axes.computeDirect(mobility);
  const Eigen::Vector3d root = axes.eigenvalues().cwiseMax(1 / max_inertia).cwiseInverse().cwiseSqrt();
  return axes.eigenvectors() * root.cwiseProduct(axes.eigenvectors().transpose() * velocity);
}

}  // namespace

CartesianSpring::CartesianSpring(const Config& config) : config_(config) {
  const RequirePositive require_positive{"cartesian spring"};
  require_positive(config.damping_ratio, "damping_ratio");
  require_positive(config.force_limit_N, "force_limit_N");
  require_positive(config.moment_limit_Nm, "moment_limit_Nm");
}

CartesianSpring::Output CartesianSpring::wrench(const CartesianStiffness& stiffness,
                                                const TipSetpoint& setpoint, const Eigen::Isometry3d& X_WT,
                                                const Wrench& velocity_W,
                                                const Mobility& mobility_W) const noexcept {
  const double k = stiffness.translation_N_per_m;
  const double kappa = stiffness.rotation_Nm_per_rad;
  const double twice_ratio = 2 * config_.damping_ratio;
  Output output;
  output.spring_W_N = k * (setpoint.p_WT_m - X_WT.translation());
  Eigen::Vector3d force_N =
      output.spring_W_N + twice_ratio * std::sqrt(k) *
                              by_root_of_inertia(mobility_W.topLeftCorner<3, 3>(), kMaxApparentMass_kg,
                                                 setpoint.v_WT_W_m_per_s - velocity_W.head<3>());
  Eigen::Vector3d moment_Nm = kappa * rotation_between(Eigen::Quaterniond(X_WT.linear()), setpoint.q_WT) -
                              twice_ratio * std::sqrt(kappa) *
                                  by_root_of_inertia(mobility_W.bottomRightCorner<3, 3>(),
                                                     kMaxApparentInertia_kg_m2, velocity_W.tail<3>());
  output.limited = shorten(force_N, config_.force_limit_N);
  output.limited = shorten(moment_Nm, config_.moment_limit_Nm) || output.limited;
  output.wrench_W << force_N, moment_Nm;
  return output;
}

}  // namespace control
