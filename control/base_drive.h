/// @file
/// Applies a planar wrench to the base: odometry from the wheels, wheel torques through the link map,
/// friction compensated per wheel (thesis 2.7.2, figure 30).
#pragma once
#include <array>
#include <optional>

#include "control/base_odometry.h"
#include "control/deadband_modulator.h"
#include "control/friction_adaptation.h"
#include "control/friction_compensator.h"
#include "control/friction_observer.h"
#include "control/limits.h"
#include "control/link_map.h"
#include "model/joint_resistance.h"

namespace control {

/// Four wheels with their rotors, reflected to the floor in rolling motion [kg, kg, kg·m²].
inline const PlanarVector kReflectedWheelInertia{18.8, 18.8, 2.8};

/// Wheel positions in, wheel torques out; does not use the wheel velocities of the motor controllers.
///   τ = Mapᵀ·W + compensation,   W and τ limited
/// Cycle: all but construction; nothing allocates or locks.
class BaseDrive {
 public:
  struct Config {
    BaseGeometry geometry;
    WrenchLimits wrench_limits;
    double torque_limit_Nm = 2.4;  ///< per wheel, compensation included
    FrictionObserver::Config observer;
    FrictionCompensator::Config compensator;
    /// Models of the four wheels for the compensator; empty: the measured wheel curves. A model's torque at
    /// rest must not exceed torque_limit_Nm.
    std::optional<std::array<model::JointResistance, 4>> wheels{};
    bool compensate_friction = true;
    /// Of each wheel's model, curve or file: the load differs from that of the measurement.
    std::array<double, 4> friction_factor{1, 1, 1, 1};
    /// Whether the compensation learns the factors, beginning with these.
    bool adapt = false;
    FrictionAdaptation::Config adaptation;
  };
  struct State {
    PlanarPose X_WB;                              ///< odometry
    PlanarVector twist_B = PlanarVector::Zero();  ///< from the filtered wheel velocities
    WheelVector wheel_velocity_rad_per_s = WheelVector::Zero();
    std::array<double, 4> friction_factor{1, 1, 1, 1};  ///< of each wheel's model, now
  };
  struct Torques {
    WheelVector torque_Nm = WheelVector::Zero();
    PlanarVector wrench_B = PlanarVector::Zero();  ///< as limited, before compensation
    bool limited = false;
  };

  /// Setup. @throws std::invalid_argument naming the value that is out of range.
  explicit BaseDrive(const Config& config);

  /// Restarts at rest at `X_WB` with the wheels at these positions.
  void reset(const WheelVector& wheel_position_rad, const PlanarPose& X_WB = {}) noexcept;

  /// After a gap in time: velocity estimates restart at zero; otherwise the displacement during the gap would
  /// count as that of one period.
  void forget_velocity(const WheelVector& wheel_position_rad) noexcept;

  /// Once per cycle, before drive(). `elapsed_s`: time since the last sample; empty: one period; 0: the last
  /// sample repeated, because no new one has arrived; the motion estimate is unchanged.
  State sense(const WheelVector& wheel_position_rad, std::optional<double> elapsed_s = {}) noexcept;
  Torques drive(const PlanarVector& wrench_B) noexcept {
    return drive(wrench_B, config_.compensate_friction);
  }
  /// Without friction compensation, so that friction helps: for braking.
  Torques drive_uncompensated(const PlanarVector& wrench_B) noexcept { return drive(wrench_B, false); }

 private:
  Torques drive(const PlanarVector& wrench_B, bool compensate) noexcept;
  void learn_friction(const State& state, double elapsed_s) noexcept;

  Config config_;
  LinkMap map_;
  BaseOdometry odometry_;
  FrictionCompensator compensator_;
  std::array<FrictionObserver, 4> observers_;
  std::array<FrictionEstimate, 4> estimates_{};
  std::array<DeadbandModulator, 4> deadband_modulators_{};
  std::optional<FrictionAdaptation> adaptation_;
  std::array<double, 4> friction_factor_;
  WheelVector command_Nm_ = WheelVector::Zero();  // of the last cycle, without compensation
  WheelVector torque_Nm_ = WheelVector::Zero();   // of the last cycle
  bool compensated_ = false;                      // in the last cycle
};

}  // namespace control
