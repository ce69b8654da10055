/// @file
/// Base and arm together pull the end effector to a set-point: joint torques by the transposed Jacobian
/// (thesis 3.4.1).
#pragma once
#include <Eigen/Geometry>
#include <array>
#include <optional>
#include <vector>

#include "control/arm_protection.h"
#include "control/base_drive.h"
#include "control/cartesian_stiffness.h"
#include "control/contact_observer.h"
#include "control/friction_compensator.h"
#include "control/friction_observer.h"
#include "control/robot_model.h"

namespace control {

/// Coulomb and viscous friction of the arm joints for the compensator. Assumed: no measured curves of the
/// joints are published.
struct ArmFriction {
  std::array<double, kArmJoints> coulomb_Nm{0.9, 0.9, 0.5, 0.35, 0.25};
  std::array<double, kArmJoints> viscous_Nm_s_per_rad{0.4, 0.4, 0.25, 0.15, 0.1};
};

/// Wheel and joint positions in, torques out:
///   τ = Jᵀ·W + N·τ_posture + τ_protection + g + friction compensation,   W from a CartesianSpring
/// N projects the posture spring, and the damping of all joints, on motions that do not move the end
/// effector: N = 1 − Jᵀ·(J·M⁻¹·Jᵀ)⁻¹·J·M⁻¹ (Khatib, IEEE J. Robotics and Automation 3:43, 1987). The base's
/// part of the sum is a wrench on the base.
/// One thread. Cycle: all but construction; nothing allocates or locks.
class WholeBodyController {
 public:
  struct Config {
    double period_s = 1e-3;
    BaseDrive::Config base;  ///< the arm uses the filter of its observers, too
    CartesianSpring::Config spring;
    ArmProtection::Config protection;
    ArmFriction arm_friction;
    FrictionCompensator::Config arm_compensator{.margin = 0.8, .full_command_Nm = 0.15};
    /// Rotors behind their gears: 1.35e-5 kg·m² by the square of the gear ratio.
    std::array<double, kArmJoints> rotor_inertia_kg_m2{0.33, 0.33, 0.135, 0.068, 0.068};
    std::array<double, kArmJoints> arm_torque_limit_Nm{9.5, 9.5, 6.0, 2.0, 1.0};  ///< robot description
    double posture_stiffness_Nm_per_rad = 6.0;
    double posture_damping_Nm_s_per_rad = 1.5;
    double posture_torque_limit_Nm = 3.0;  ///< of the posture spring, before damping
    double settling_rate_per_s = 3.0;      ///< integral gain on each joint's spring torque in settle()
    std::array<double, kArmJoints> settling_limit_Nm{3.0, 3.0, 2.0, 1.0, 0.5};
    double settled_fade_s = 5.0;  ///< time constant with which the integral decays afterwards
    ModelChanges model;           ///< known differences from the description
    ContactObserver::Config contact;
  };
  struct State {
    PlanarPose X_WB;
    ChainVector position = ChainVector::Zero();
    ChainVector velocity = ChainVector::Zero();
    Eigen::Isometry3d X_WT = Eigen::Isometry3d::Identity();
    Wrench tip_velocity_W = Wrench::Zero();  ///< [v; ω]
    WheelVector wheel_velocity_rad_per_s = WheelVector::Zero();
    Mobility mobility_W = Mobility::Identity();             ///< of the end effector
    Eigen::Vector3d contact_W_N = Eigen::Vector3d::Zero();  ///< estimated, on the end effector
  };
  struct Output {
    WheelVector wheel_torque_Nm = WheelVector::Zero();
    ArmVector arm_torque_Nm = ArmVector::Zero();
    Wrench wrench_W = Wrench::Zero();                      ///< on the end effector
    Eigen::Vector3d spring_W_N = Eigen::Vector3d::Zero();  ///< spring part of it
    bool limited = false;                                  ///< a force or torque was limited
    bool protecting = false;                               ///< the arm protection is active
  };

  /// @throws std::invalid_argument naming the value out of range.
  explicit WholeBodyController(const Config& config);

  /// Restarts at rest: W is the current pose of the base.
  void reset(const WheelVector& wheel_position_rad, const ArmVector& arm_position_rad) noexcept;
  /// After a gap in time: velocity estimates restart at zero.
  void forget_velocity(const WheelVector& wheel_position_rad, const ArmVector& arm_position_rad) noexcept;

  /// Once per cycle, before the others. Finite positions; `elapsed_s` as in BaseDrive::sense().
  /// `arm_torque_Nm`: commanded since the last sample; empty if the arm was not under torque control, which
  /// leaves the contact force at zero.
  const State& sense(const WheelVector& wheel_position_rad, const ArmVector& arm_position_rad,
                     std::optional<double> elapsed_s = {},
                     const std::optional<ArmVector>& arm_torque_Nm = {}) noexcept;

  /// Posture of the arm in the null space of the end-effector task.
  void set_posture(const ArmVector& position_rad) noexcept { posture_rad_ = position_rad; }
  Output track(const TipSetpoint& setpoint, const CartesianStiffness& stiffness) noexcept;
  /// Arm only; the base is braked. The arm is also pulled to its posture, which should match the set-point.
  /// `summing`: integrates the remaining error to overcome friction and model errors.
  Output settle(const TipSetpoint& setpoint, const CartesianStiffness& stiffness, bool summing) noexcept;
  /// The arm rests under the last command: this command becomes the one for a slack spring, so the arm stays
  /// where it is when the set-point moves to it. track() lets it decay slowly.
  void adopt_rest() noexcept;
  /// Lets the arm sink: `share` of its weight is not supported, and all joints are damped.
  ArmVector lowering_torque_Nm(double share) noexcept;
  /// Brakes the base to rest.
  WheelVector brake_base() noexcept;

  const State& state() const noexcept { return state_; }

 private:
  void observe_contact(const ChainMatrix& mass, double elapsed_s, const ArmVector& torque_Nm) noexcept;
  ArmVector posture_pull_Nm() const noexcept;
  ChainVector posture_force() const noexcept;
  Output drive_arm(const CartesianSpring::Output& spring, const ArmVector& torque_Nm) noexcept;

  Config config_;
  RobotModel model_;
  BaseDrive base_;
  CartesianSpring spring_;
  ArmProtection protection_;
  ContactObserver contact_;
  FrictionCompensator arm_compensator_;
  ChainVector reflected_inertia_;  // of the motors, through the gears, and of the wheels
  std::vector<FrictionObserver> arm_observers_;
  std::array<FrictionEstimate, kArmJoints> arm_estimates_{};
  State state_;
  Eigen::Matrix<double, kChainAxes, 6> response_ = Eigen::Matrix<double, kChainAxes, 6>::Zero();  // M⁻¹·Jᵀ
  bool fresh_ = true;  // the last sample is new
  ArmVector posture_rad_ = ArmVector::Zero();
  ArmVector settled_Nm_ = ArmVector::Zero();
  ArmVector spring_share_Nm_ = ArmVector::Zero();  // of the last command: removed by a slack spring
};

}  // namespace control
