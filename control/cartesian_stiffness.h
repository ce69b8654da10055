/// @file
/// Spring and damper between the end effector and its set-point (thesis 3.4.1).
#pragma once
#include <Eigen/Geometry>

#include "control/robot_model.h"
#include "control/tip_pose.h"

namespace control {

struct CartesianStiffness {
  double translation_N_per_m = 0.0;
  double rotation_Nm_per_rad = 0.0;
};

/// J·M⁻¹·Jᵀ in W, linear rows first: the acceleration of the end effector per wrench on it [1/kg, 1/(kg·m²)].
using Mobility = Eigen::Matrix<double, 6, 6>;

/// On the end effector:
///   f = k·(p_set − p) + 2ζ·√k·Λ_v^½·(v_set − v),   n = κ·θ − 2ζ·√κ·Λ_ω^½·ω,   each limited in magnitude,
/// with θ the rotation from the end effector to the set-point, and Λ_v and Λ_ω the apparent mass and inertia
/// of the end effector: the inverses of the mobility's translation and rotation blocks. So every direction
/// has the damping ratio ζ, whatever its apparent mass (Albu-Schäffer et al., IEEE ICRA 2003, p. 3704).
/// Cycle: pure.
class CartesianSpring {
 public:
  struct Config {
    double damping_ratio = 1.0;  ///< ζ
    double force_limit_N = 40.0;
    double moment_limit_Nm = 6.0;
  };
  struct Output {
    Wrench wrench_W = Wrench::Zero();                      ///< of spring and damper, limited
    Eigen::Vector3d spring_W_N = Eigen::Vector3d::Zero();  ///< spring force only, not limited
    bool limited = false;
  };

  /// @throws std::invalid_argument naming the value out of range.
  explicit CartesianSpring(const Config& config);

  /// `velocity_W`: of the end effector, [v; ω]. Of `mobility_W`, the lower triangles of both blocks count; a
  /// direction in which the end effector cannot move has the damping of kMaxApparentMass_kg or
  /// kMaxApparentInertia_kg_m2.
  Output wrench(const CartesianStiffness& stiffness, const TipSetpoint& setpoint,
                const Eigen::Isometry3d& X_WT, const Wrench& velocity_W,
                const Mobility& mobility_W) const noexcept;

  /// More than robot and payload have.
  static constexpr double kMaxApparentMass_kg = 100.0;
  static constexpr double kMaxApparentInertia_kg_m2 = 10.0;

 private:
  Config config_;
};

}  // namespace control
