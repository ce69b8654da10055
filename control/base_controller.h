/// @file
/// The base under wrench control: a spring and damper to a reference, wheel torques through the link map,
/// friction compensated wheel by wheel (thesis 2.7.2, figure 30).
#pragma once
#include <array>
#include <optional>

#include "control/base_odometry.h"
#include "control/base_path.h"
#include "control/friction_compensator.h"
#include "control/friction_observer.h"
#include "control/joint_resistance.h"
#include "control/limits.h"
#include "control/link_map.h"
#include "control/small_torques.h"

namespace control {

/// Wheel positions in, wheel torques out; no wheel velocity from the motor controllers is used.
///   W = Rᵀ·[K·(p_ref − p) + D·(v_ref − v) + M·a_ref]   limited,   τ = Mapᵀ·W + compensation   limited
/// Cycle: reset() and step() neither allocate nor lock.
class BaseController {
 public:
  struct Config {
    BaseGeometry geometry;
    PlanarVector stiffness = {150, 150, 22};  ///< K [N/m, N/m, N·m/rad]
    PlanarVector damping = {150, 150, 22};    ///< D [N·s/m, N·s/m, N·m·s/rad]
    /// M [kg, kg, kg·m²]: the body (29.5, 4.0) and, reflected to the floor, wheels and rotors (18.8, 2.8).
    PlanarVector feedforward_inertia = {48, 48, 6.8};
    WrenchLimits wrench_limits;
    double torque_limit_Nm = 2.4;  ///< of a wheel, compensation included
    FrictionObserver::Config observer;
    FrictionCompensator::Config compensator;
    /// What the compensator takes the four wheels to be; none: the measured wheel curves. At rest no torque
    /// of a model may be more than torque_limit_Nm.
    std::optional<std::array<JointResistance, 4>> wheels{};
    bool compensate_friction = true;
  };
  struct Output {
    WheelVector torque_Nm = WheelVector::Zero();
    PlanarVector wrench_B = PlanarVector::Zero();  ///< commanded, before compensation
    PlanarPose X_WB;                               ///< odometry
    PlanarVector twist_B = PlanarVector::Zero();   ///< from the filtered wheel velocities
    WheelVector wheel_velocity_rad_per_s = WheelVector::Zero();
    bool limited = false;
  };

  /// Setup. @throws std::invalid_argument naming the value that is out of range.
  explicit BaseController(const Config& config);

  /// Start again at rest at `X_WB` with the wheels where they are.
  void reset(const WheelVector& wheel_position_rad, const PlanarPose& X_WB = {}) noexcept;

  /// After a gap in time: velocities begin at zero again instead of taking the way of the gap for one
  /// period's.
  void forget_velocity(const WheelVector& wheel_position_rad) noexcept;

  Output step(const WheelVector& wheel_position_rad, const BaseReference& reference) noexcept;
  /// Senses without driving, for cycles in which the drives are off: zero torque and wrench.
  Output observe(const WheelVector& wheel_position_rad) noexcept;
  /// Stopping without a reference: damping towards rest, no spring, and friction left to help.
  Output brake(const WheelVector& wheel_position_rad) noexcept;

 private:
  void drive(const PlanarVector& wrench_B, bool compensate, Output& output) noexcept;

  Config config_;
  LinkMap map_;
  BaseOdometry odometry_;
  FrictionCompensator compensator_;
  std::array<FrictionObserver, 4> observers_;
  std::array<FrictionEstimate, 4> estimates_{};
  std::array<SmallTorques, 4> small_torques_{};
};

}  // namespace control
