#include "control/cartesian_stiffness.h"

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

}  // namespace

CartesianSpring::CartesianSpring(const Config& config) : config_(config) {
  const RequirePositive require_positive{"cartesian spring"};
  require_positive(config.damping_ratio, "damping_ratio");
  require_positive(config.mass_kg, "mass_kg");
  require_positive(config.inertia_kg_m2, "inertia_kg_m2");
  require_positive(config.force_limit_N, "force_limit_N");
  require_positive(config.moment_limit_Nm, "moment_limit_Nm");
}

CartesianSpring::Output CartesianSpring::wrench(const CartesianStiffness& stiffness,
                                                const TipSetpoint& setpoint, const Eigen::Isometry3d& X_WT,
                                                const Wrench& velocity_W) const noexcept {
  const double k = stiffness.translation_N_per_m;
  const double kappa = stiffness.rotation_Nm_per_rad;
  Output output;
  output.spring_W_N = k * (setpoint.p_WT_m - X_WT.translation());
  Eigen::Vector3d force_N = output.spring_W_N + 2 * config_.damping_ratio * std::sqrt(k * config_.mass_kg) *
                                                    (setpoint.v_WT_W_m_per_s - velocity_W.head<3>());
  Eigen::Vector3d moment_Nm =
      kappa * rotation_between(Eigen::Quaterniond(X_WT.linear()), setpoint.q_WT) -
      2 * config_.damping_ratio * std::sqrt(kappa * config_.inertia_kg_m2) * velocity_W.tail<3>();
  output.limited = shorten(force_N, config_.force_limit_N);
  output.limited = shorten(moment_Nm, config_.moment_limit_Nm) || output.limited;
  output.wrench_W << force_N, moment_Nm;
  return output;
}

}  // namespace control
