/// @file
/// Force on the end effector, estimated from the torques of the arm: a generalised-momentum observer
/// (De Luca and Mattone, IEEE ICRA 2005, p. 999; Haddadin et al., IEEE Trans. Robotics 33:1292, 2017).
#pragma once
#include <Eigen/Core>

#include "control/robot_model.h"

namespace control {

/// Of the momentum p = M·q̇ of the arm's joints, with the rotors and with the base that carries it,
///   r = K·(p − p₀ − ∫(τ − τ_f + Ṁ·q̇ − c − g + r) dt)
/// follows the torque of external forces as a first-order lag of rate K. Only commanded torques are used, so
/// the sign of a measured current does not matter. The force at the end effector is the one that explains r
/// best, each joint weighted by how well its friction is known; it has no moment [assumption: a contact of
/// the gripper's tip].
///
/// The friction of a joint at rest is that of its last motion, held: it is right for a joint that was driven
/// into a contact, and wrong by up to twice the Coulomb friction for one that is relaxed without moving. A
/// result that is not finite restarts it.
/// One thread. Cycle: all but construction.
class ContactObserver {
 public:
  struct Config {
    double rate_per_s = 60.0;  ///< K
    /// Stiffness of the friction at rest: the whole Coulomb friction turns round within a milliradian
    /// [assumption].
    double presliding_Nm_per_rad = 2000.0;
    /// Standard deviation of what friction and model leave unexplained, for the weights.
    ArmVector uncertainty_Nm = (ArmVector() << 0.6, 0.6, 0.4, 0.3, 0.2).finished();
  };
  struct Input {
    double elapsed_s = 0.0;                  ///< since the last step, positive
    ChainMatrix mass = ChainMatrix::Zero();  ///< links and rotors
    ChainVector velocity = ChainVector::Zero();
    ArmVector coriolis_Nm = ArmVector::Zero();
    ArmVector gravity_Nm = ArmVector::Zero();
    ArmVector position_rad = ArmVector::Zero();
    ArmVector sliding_Nm = ArmVector::Zero();  ///< friction at this speed, not negative
    ArmVector torque_Nm = ArmVector::Zero();   ///< commanded since the last step
    Eigen::Matrix<double, 3, kArmJoints> J_WT =
        Eigen::Matrix<double, 3, kArmJoints>::Zero();  ///< of its point
  };

  /// @throws std::invalid_argument naming the value out of range.
  explicit ContactObserver(const Config& config);

  /// The next step is the first: no force, whatever the momentum.
  void reset() noexcept;
  void step(const Input& input) noexcept;

  const ArmVector& torque_Nm() const noexcept { return external_Nm_; }
  /// Of the environment on the end effector, in W.
  const Eigen::Vector3d& force_W_N() const noexcept { return force_W_N_; }

 private:
  Config config_;
  bool started_ = false;
  ChainMatrix mass_ = ChainMatrix::Zero();  // of the last step
  ArmVector expected_ = ArmVector::Zero();  // momentum without what is observed now
  ArmVector position_rad_ = ArmVector::Zero();
  ArmVector friction_Nm_ = ArmVector::Zero();  // against positive motion
  ArmVector external_Nm_ = ArmVector::Zero();
  Eigen::Vector3d force_W_N_ = Eigen::Vector3d::Zero();
};

}  // namespace control
