/// @file
/// The base as something a planar wrench can be put on: odometry from the wheels, wheel torques through the
/// link map, friction compensated wheel by wheel (thesis 2.7.2, figure 30).
#pragma once
#include <array>
#include <optional>

#include "control/base_odometry.h"
#include "control/friction_compensator.h"
#include "control/friction_observer.h"
#include "control/limits.h"
#include "control/link_map.h"
#include "control/small_torques.h"
#include "model/joint_resistance.h"

namespace control {

/// Of the four wheels with their rotors, as the floor feels it when they roll [kg, kg, kg·m²].
inline const PlanarVector kReflectedWheelInertia{18.8, 18.8, 2.8};

/// Wheel positions in, wheel torques out; no wheel velocity from the motor controllers is used.
///   τ = Mapᵀ·W + compensation,   W and τ limited
/// Cycle: all but construction; nothing allocates or locks.
class BaseDrive {
 public:
  struct Config {
    BaseGeometry geometry;
    WrenchLimits wrench_limits;
    double torque_limit_Nm = 2.4;  ///< of a wheel, compensation included
    FrictionObserver::Config observer;
    FrictionCompensator::Config compensator;
    /// What the compensator takes the four wheels to be; none: the measured wheel curves. At rest no torque
    /// of a model may be more than torque_limit_Nm.
    std::optional<std::array<model::JointResistance, 4>> wheels{};
    bool compensate_friction = true;
  };
  struct State {
    PlanarPose X_WB;                              ///< odometry
    PlanarVector twist_B = PlanarVector::Zero();  ///< from the filtered wheel velocities
    WheelVector wheel_velocity_rad_per_s = WheelVector::Zero();
  };
  struct Torques {
    WheelVector torque_Nm = WheelVector::Zero();
    PlanarVector wrench_B = PlanarVector::Zero();  ///< as limited, before compensation
    bool limited = false;
  };

  /// Setup. @throws std::invalid_argument naming the value that is out of range.
  explicit BaseDrive(const Config& config);

  /// Start again at rest at `X_WB` with the wheels where they are.
  void reset(const WheelVector& wheel_position_rad, const PlanarPose& X_WB = {}) noexcept;

  /// After a gap in time: velocities begin at zero again instead of taking the way of the gap for one
  /// period's.
  void forget_velocity(const WheelVector& wheel_position_rad) noexcept;

  /// Once a cycle, before drive(). `elapsed_s`: since the last sample, none: a period. 0: it is the same one
  /// once more, as no other has come, and all that is known of the motion stays.
  State sense(const WheelVector& wheel_position_rad, std::optional<double> elapsed_s = {}) noexcept;
  Torques drive(const PlanarVector& wrench_B) noexcept {
    return drive(wrench_B, config_.compensate_friction);
  }
  /// Friction is left to help: for braking.
  Torques drive_uncompensated(const PlanarVector& wrench_B) noexcept { return drive(wrench_B, false); }

 private:
  Torques drive(const PlanarVector& wrench_B, bool compensate) noexcept;

  Config config_;
  LinkMap map_;
  BaseOdometry odometry_;
  FrictionCompensator compensator_;
  std::array<FrictionObserver, 4> observers_;
  std::array<FrictionEstimate, 4> estimates_{};
  std::array<SmallTorques, 4> small_torques_{};
};

}  // namespace control
