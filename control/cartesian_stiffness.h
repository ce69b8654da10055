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

/// On the end effector:
///   f = k·(p_set − p) + 2ζ·√(k·m)·(v_set − v),   n = κ·θ − 2ζ·√(κ·J)·ω,   each limited in magnitude,
/// with θ the rotation from the end effector to the set-point. The damping follows the stiffness. Cycle:
/// pure.
class CartesianSpring {
 public:
  struct Config {
    double damping_ratio = 0.7;  ///< ζ
    /// Apparent mass at the end effector: mostly the rotors of the arm, reflected through their gears.
    double mass_kg = 3.0;
    double inertia_kg_m2 = 0.3;
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

  /// `velocity_W`: of the end effector, [v; ω].
  Output wrench(const CartesianStiffness& stiffness, const TipSetpoint& setpoint,
                const Eigen::Isometry3d& X_WT, const Wrench& velocity_W) const noexcept;

 private:
  Config config_;
};

}  // namespace control
