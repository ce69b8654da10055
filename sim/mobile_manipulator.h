/// @file
/// The complete simulated youBot: base on mecanum wheels, arm of five elastic joints, and the objects that
/// its end effector touches.
///
/// Frames, angles and units as in control/robot_model.h. Errors: std::invalid_argument from the constructor.
/// One thread; measure() and advance() neither allocate nor lock.
#pragma once
#include <Eigen/Core>
#include <Eigen/Geometry>
#include <array>
#include <chrono>
#include <cstdint>
#include <span>

#include "control/planar.h"
#include "control/robot_model.h"
#include "hal/plant.h"
#include "sim/bus/axis_data.h"
#include "sim/elastic_joint.h"
#include "sim/environment.h"
#include "sim/mecanum_wheels.h"

namespace sim {

/// A robot that differs from the description by some percent and millimetres, like a real one, so that the
/// model of the controller is never exact. An assumption.
control::ModelChanges built_robot();

struct MobileManipulatorParameters {
  /// Their noise seed is that of the whole robot. When lifted, the base is held in place.
  MecanumWheelParameters wheels;
  /// Gears, friction and end stops. The joints' controllers are tuned for the load inertia.
  std::array<bus::ArmJointData, control::kArmJoints> arm = bus::kArmJointData;
  GearGive gear;
  control::ModelChanges masses = built_robot();
  control::ArmVector start_rad{0.2, 0.2, -0.2, 0.2, 0.2};  ///< default: folded, off the end stops
  std::chrono::nanoseconds step{50'000};                   ///< integration step, see the convergence test
  /// Mass matrix, weight and Jacobian are held for this time: links at 2 rad/s turn by 1 mrad in it. See the
  /// convergence test.
  std::chrono::nanoseconds model_hold{500'000};
};

/// Joints in HAL order: wheels 1 to 4, arm joints 1 to 5, which are homed.
///
/// Body and links obey M·q̈ + c + g = τ + Jᵀ·F of control::RobotModel, integrated semi-implicitly: velocity
/// first, then position with the new velocity. Held quantities are evaluated in the middle of their hold
/// time, which makes the error of second order in it. Rotors only have inertia about their joints' axes. Not
/// modelled: contacts other than the end effector's, collisions of links and base, and the load that the
/// arm's motion moves between the wheels.
class MobileManipulator final : public hal::Plant {
 public:
  /// @throws std::invalid_argument naming the invalid parameter.
  explicit MobileManipulator(const MobileManipulatorParameters& parameters = {},
                             const EnvironmentParameters& environment = {});

  int joint_count() const noexcept override { return MecanumWheels::kCount + control::kArmJoints; }
  void measure(std::span<hal::JointSample> samples) noexcept override;
  void advance(std::span<const hal::JointCommand> commands, bool powered,
               std::chrono::nanoseconds duration) noexcept override;

  /// Lifted off the ground the base stays where it is.
  void set_on_ground(bool on_ground) noexcept;
  /// Sets a force that acts on the end effector from now on.
  void push_tip(const Eigen::Vector3d& force_W_N) noexcept { push_W_N_ = force_W_N; }

  /// True values, for tests and the summary of a simulated run.
  control::PlanarPose pose() const noexcept { return {q_[0], q_[1], q_[2]}; }
  control::PlanarVector twist() const noexcept;  ///< of the base, in B
  control::ArmVector arm_rad() const noexcept { return q_.tail<control::kArmJoints>(); }  ///< of the links
  const control::ChainVector& velocity() const noexcept { return v_; }
  const Eigen::Isometry3d& X_WT() const noexcept { return X_WT_; }
  const Eigen::Vector3d& v_WT_m_per_s() const noexcept { return v_WT_m_per_s_; }
  /// Of the environment on the end effector, without push_tip(): mean over the last advance().
  const Eigen::Vector3d& contact_force_W_N() const noexcept { return contact_force_W_N_; }
  Drive& wheel(int index) noexcept { return wheels_[static_cast<std::size_t>(index)]; }
  const ElasticJoint& joint(int index) const noexcept { return joints_[static_cast<std::size_t>(index)]; }
  Environment& environment() noexcept { return environment_; }
  /// Of body, links, rotors and wheels.
  double kinetic_energy_J() noexcept;
  /// Of the weight, relative to the arm with all joints at 0, and of the elastic joints.
  double potential_energy_J() noexcept;
  double arm_motor_work_J() const noexcept;

 private:
  std::array<ElasticJoint, control::kArmJoints> make_joints();
  bool base_moves() const noexcept { return wheels_.on_ground(); }
  /// Sets the quantities held from now on for `duration_s`.
  void hold_model(double duration_s) noexcept;
  control::ChainMatrix inverse_mass(const control::ChainMatrix& mass) const noexcept;
  void step(double step_s) noexcept;
  void look_at_tip() noexcept;

  MobileManipulatorParameters parameters_;
  control::RobotModel model_;
  control::ChainVector q_;
  control::ChainVector v_ = control::ChainVector::Zero();
  MecanumWheels wheels_;
  std::array<ElasticJoint, control::kArmJoints> joints_;
  Environment environment_;
  Eigen::Vector3d push_W_N_ = Eigen::Vector3d::Zero();

  struct Held {
    double left_s = 0.0;
    control::ChainVector q;
    control::ChainVector v;
    control::ChainVector bias_Nm;  // c + g
    control::ChainMatrix inverse_mass;
    control::PointJacobian tip_jacobian;
    Eigen::Vector3d p_WT_m;
  };
  Held held_;

  Eigen::Isometry3d X_WT_;
  Eigen::Vector3d v_WT_m_per_s_;
  Eigen::Vector3d contact_force_W_N_ = Eigen::Vector3d::Zero();
  Eigen::Vector3d contact_impulse_W_N_s_ = Eigen::Vector3d::Zero();
};

}  // namespace sim
