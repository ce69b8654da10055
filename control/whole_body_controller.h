/// @file
/// Base and arm together pull the tip to a set-point: joint torques by the transposed Jacobian
/// (thesis 3.4.1).
#pragma once
#include <Eigen/Geometry>
#include <array>
#include <optional>
#include <vector>

#include "control/arm_protection.h"
#include "control/base_drive.h"
#include "control/cartesian_stiffness.h"
#include "control/friction_compensator.h"
#include "control/friction_observer.h"
#include "control/robot_model.h"

namespace control {

/// Of the arm's joints, what the compensator takes them to be: Coulomb's and viscous friction. Assumptions,
/// as nobody has published the joints' curves.
struct ArmFriction {
  std::array<double, kArmJoints> coulomb_Nm{0.9, 0.9, 0.5, 0.35, 0.25};
  std::array<double, kArmJoints> viscous_Nm_s_per_rad{0.4, 0.4, 0.25, 0.15, 0.1};
};

/// Positions of wheels and joints in, torques out:
///   τ = Jᵀ·W + N·τ_posture + τ_protection + g + friction compensation,   W from a CartesianSpring
/// N projects the pull towards a posture, and damping of everything, on motions that leave the tip alone:
/// N = 1 − Jᵀ·(J·M⁻¹·Jᵀ)⁻¹·J·M⁻¹ (Khatib, IEEE J. Robotics and Automation 3:43, 1987). The base's part of the
/// sum is a wrench on the base.
/// One thread. Cycle: all but construction; nothing allocates or locks.
class WholeBodyController {
 public:
  struct Config {
    double period_s = 1e-3;
    BaseDrive::Config base;  ///< its observers' filter serves the arm, too
    CartesianSpring::Config spring;
    ArmProtection::Config protection;
    ArmFriction arm_friction;
    FrictionCompensator::Config arm_compensator{.margin = 0.8, .full_command_Nm = 0.15};
    std::array<double, kArmJoints> arm_torque_limit_Nm{9.5, 9.5, 6.0, 2.0, 1.0};  ///< robot description
    double posture_stiffness_Nm_per_rad = 6.0;
    double posture_damping_Nm_s_per_rad = 1.5;
    double posture_torque_limit_Nm = 3.0;  ///< of the pull, before damping
    double settling_rate_per_s = 3.0;      ///< of the sum of what the spring asks of each joint
    std::array<double, kArmJoints> settling_limit_Nm{3.0, 3.0, 2.0, 1.0, 0.5};
    double settled_fade_s = 5.0;  ///< time constant with which the sum is forgotten afterwards
    ModelChanges model;           ///< what is known to be different from the description
  };
  struct State {
    PlanarPose X_WB;
    ChainVector position = ChainVector::Zero();
    ChainVector velocity = ChainVector::Zero();
    Eigen::Isometry3d X_WT = Eigen::Isometry3d::Identity();
    Wrench tip_velocity_W = Wrench::Zero();  ///< [v; ω]
    WheelVector wheel_velocity_rad_per_s = WheelVector::Zero();
  };
  struct Output {
    WheelVector wheel_torque_Nm = WheelVector::Zero();
    ArmVector arm_torque_Nm = ArmVector::Zero();
    Wrench wrench_W = Wrench::Zero();                      ///< on the tip
    Eigen::Vector3d spring_W_N = Eigen::Vector3d::Zero();  ///< of it, the spring's force
    bool limited = false;                                  ///< some force or torque was cut
    bool protecting = false;                               ///< a limit of the arm pushes
  };

  /// @throws std::invalid_argument naming the value out of range.
  explicit WholeBodyController(const Config& config);

  /// Starts anew at rest: W is where the base stands now.
  void reset(const WheelVector& wheel_position_rad, const ArmVector& arm_position_rad) noexcept;
  /// After a gap in time: velocities begin at zero again.
  void forget_velocity(const WheelVector& wheel_position_rad, const ArmVector& arm_position_rad) noexcept;

  /// Once a cycle, before the others. Finite positions; `elapsed_s` as in BaseDrive::sense().
  const State& sense(const WheelVector& wheel_position_rad, const ArmVector& arm_position_rad,
                     std::optional<double> elapsed_s = {}) noexcept;

  /// The arm's posture where the tip's task leaves a choice.
  void set_posture(const ArmVector& position_rad) noexcept { posture_rad_ = position_rad; }
  Output track(const TipSetpoint& setpoint, const CartesianStiffness& stiffness) noexcept;
  /// The arm alone, pulled to its posture, too, which should be one for this set-point; the base braked.
  /// `summing`: friction and errors of the model are overcome by summing up what is left.
  Output settle(const TipSetpoint& setpoint, const CartesianStiffness& stiffness, bool summing) noexcept;
  /// The arm rests under what the last call commanded: from now on that is what it gets at a slack spring,
  /// and so it stays where it is when the set-point comes to it. Forgotten slowly by track().
  void adopt_rest() noexcept;
  /// Lets the arm sink: `share` of its weight is no longer carried, and all joints are damped.
  ArmVector lowering_torque_Nm(double share) noexcept;
  /// The base comes to rest, wherever.
  WheelVector brake_base() noexcept;

  const State& state() const noexcept { return state_; }

 private:
  ArmVector posture_pull_Nm() const noexcept;
  ChainVector posture_force() noexcept;
  Output drive_arm(const CartesianSpring::Output& spring, const ArmVector& torque_Nm) noexcept;

  Config config_;
  RobotModel model_;
  BaseDrive base_;
  CartesianSpring spring_;
  ArmProtection protection_;
  FrictionCompensator arm_compensator_;
  std::vector<FrictionObserver> arm_observers_;
  std::array<FrictionEstimate, kArmJoints> arm_estimates_{};
  State state_;
  bool fresh_ = true;  // the sample that was sensed last
  ArmVector posture_rad_ = ArmVector::Zero();
  ArmVector settled_Nm_ = ArmVector::Zero();
  ArmVector spring_share_Nm_ = ArmVector::Zero();  // of the last command: what a slack spring takes away
};

}  // namespace control
