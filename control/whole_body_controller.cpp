#include "control/whole_body_controller.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>

#include "control/positive.h"

namespace control {
namespace {

/// Damps the base while the arm moves to its posture [N·s/m, N·s/m, N·m·s/rad].
const PlanarVector kBasePostureDamping(30, 30, 5);
const PlanarVector kBrake(150, 150, 22);
/// With this damping, its weight lowers the stretched arm at about 1 rad/s [N·m·s/rad].
const ArmVector kLoweringDamping = (ArmVector() << 6, 8, 5, 2, 1).finished();

model::friction::SlidingTable arm_table(const ArmFriction& friction, std::size_t joint) {
  const double coulomb = friction.coulomb_Nm[joint];
  const double viscous = friction.viscous_Nm_s_per_rad[joint];
  if (!(std::isfinite(coulomb) && coulomb >= 0 && std::isfinite(viscous) && viscous >= 0))
    throw std::invalid_argument("whole-body controller: friction of arm joint " + std::to_string(joint + 1) +
                                " must be finite and not negative");
  return {[=](double velocity) { return coulomb + viscous * std::abs(velocity); }, {}};
}

}  // namespace

WholeBodyController::WholeBodyController(const Config& config)
    : config_(config),
      model_(config.model),
      base_(config.base),
      spring_(config.spring),
      protection_(config.protection, model_.ranges()),
      contact_(config.contact),
      arm_compensator_(config.arm_compensator) {
  reflected_inertia_ << kReflectedWheelInertia,
      Eigen::Map<const ArmVector>(config.rotor_inertia_kg_m2.data());
  const RequirePositive require_positive{"whole-body controller"};
  require_positive(config.period_s, "period_s");
  require_positive(config.settled_fade_s, "settled_fade_s");
  require_positive(config.posture_torque_limit_Nm, "posture_torque_limit_Nm");
  require_positive(config.posture_stiffness_Nm_per_rad, "posture_stiffness_Nm_per_rad");
  require_positive(config.posture_damping_Nm_s_per_rad, "posture_damping_Nm_s_per_rad");
  require_positive(config.settling_rate_per_s, "settling_rate_per_s");
  for (const double limit_Nm : config.settling_limit_Nm) require_positive(limit_Nm, "settling_limit_Nm");
  for (const double rotor_kg_m2 : config.rotor_inertia_kg_m2)
    require_positive(rotor_kg_m2, "rotor_inertia_kg_m2");
  for (const double limit_Nm : config.arm_torque_limit_Nm) require_positive(limit_Nm, "arm_torque_limit_Nm");
  for (std::size_t i = 0; i < kArmJoints; ++i)
    arm_observers_.emplace_back(arm_table(config.arm_friction, i), config.base.observer);
}

void WholeBodyController::reset(const WheelVector& wheel_position_rad,
                                const ArmVector& arm_position_rad) noexcept {
  base_.reset(wheel_position_rad);
  settled_Nm_.setZero();
  forget_velocity(wheel_position_rad, arm_position_rad);
}

void WholeBodyController::forget_velocity(const WheelVector& wheel_position_rad,
                                          const ArmVector& arm_position_rad) noexcept {
  base_.forget_velocity(wheel_position_rad);
  for (int i = 0; i < kArmJoints; ++i) arm_observers_[static_cast<std::size_t>(i)].reset(arm_position_rad[i]);
}

const WholeBodyController::State& WholeBodyController::sense(
    const WheelVector& wheel_position_rad, const ArmVector& arm_position_rad, std::optional<double> elapsed_s,
    const std::optional<ArmVector>& arm_torque_Nm) noexcept {
  fresh_ = elapsed_s.value_or(config_.period_s) > 0;
  const BaseDrive::State base = base_.sense(wheel_position_rad, elapsed_s);
  state_.X_WB = base.X_WB;
  state_.wheel_velocity_rad_per_s = base.wheel_velocity_rad_per_s;
  state_.position << base.X_WB.x_m, base.X_WB.y_m, base.X_WB.yaw_rad, arm_position_rad;
  state_.velocity.head<kBaseAxes>() = rotated(base.twist_B, base.X_WB.yaw_rad);
  for (int i = 0; i < kArmJoints; ++i) {
    const auto joint = static_cast<std::size_t>(i);
    arm_estimates_[joint] = arm_observers_[joint].step(arm_position_rad[i], elapsed_s);
    state_.velocity[kBaseAxes + i] = arm_estimates_[joint].velocity_rad_per_s;
  }
  model_.update(state_.position);
  state_.X_WT = model_.X_WT();
  state_.tip_velocity_W = model_.J_WT() * state_.velocity;

  ChainMatrix mass = model_.mass();
  mass.diagonal() += reflected_inertia_;
  response_ = mass.llt().solve(model_.J_WT().transpose());
  state_.mobility_W = model_.J_WT() * response_;
  if (!arm_torque_Nm)
    contact_.reset();
  else if (fresh_)
    observe_contact(mass, elapsed_s.value_or(config_.period_s), *arm_torque_Nm);
  state_.contact_W_N = contact_.force_W_N();
  return state_;
}

void WholeBodyController::observe_contact(const ChainMatrix& mass, double elapsed_s,
                                          const ArmVector& torque_Nm) noexcept {
  ContactObserver::Input input{.elapsed_s = elapsed_s,
                               .mass = mass,
                               .velocity = state_.velocity,
                               .coriolis_Nm = model_.coriolis_Nm(state_.velocity).tail<kArmJoints>(),
                               .gravity_Nm = model_.gravity_Nm().tail<kArmJoints>(),
                               .position_rad = state_.position.tail<kArmJoints>(),
                               .torque_Nm = torque_Nm,
                               .J_WT = model_.J_WT().topRightCorner<3, kArmJoints>()};
  for (int i = 0; i < kArmJoints; ++i) {
    const auto joint = static_cast<std::size_t>(i);
    const double velocity = arm_estimates_[joint].velocity_rad_per_s;
    input.sliding_Nm[i] = config_.arm_friction.coulomb_Nm[joint] +
                          config_.arm_friction.viscous_Nm_s_per_rad[joint] * std::abs(velocity);
  }
  contact_.step(input);
}

WholeBodyController::Output WholeBodyController::track(const TipSetpoint& setpoint,
                                                       const CartesianStiffness& stiffness) noexcept {
  const CartesianSpring::Output spring =
      spring_.wrench(stiffness, setpoint, state_.X_WT, state_.tip_velocity_W, state_.mobility_W);
  settled_Nm_ *= 1 - std::min(1.0, config_.period_s / config_.settled_fade_s);
  const ChainVector force = model_.J_WT().transpose() * spring.wrench_W + posture_force();

  Output output = drive_arm(spring, force.tail<kArmJoints>());
  const PlanarVector force_W = force.head<kBaseAxes>();
  const BaseDrive::Torques wheels = base_.drive(rotated(force_W, -state_.X_WB.yaw_rad));
  output.wheel_torque_Nm = wheels.torque_Nm;
  output.limited = output.limited || wheels.limited;
  return output;
}

WholeBodyController::Output WholeBodyController::settle(const TipSetpoint& setpoint,
                                                        const CartesianStiffness& stiffness,
                                                        bool summing) noexcept {
  const CartesianSpring::Output spring =
      spring_.wrench(stiffness, setpoint, state_.X_WT, state_.tip_velocity_W, state_.mobility_W);
  const ArmVector torque_Nm =
      model_.J_WT().rightCols<kArmJoints>().transpose() * spring.wrench_W + posture_pull_Nm();
  // Do not integrate the same sample twice.
  if (summing && fresh_)
    for (int i = 0; i < kArmJoints; ++i) {
      const double limit_Nm = config_.settling_limit_Nm[static_cast<std::size_t>(i)];
      settled_Nm_[i] =
          std::clamp(settled_Nm_[i] + config_.settling_rate_per_s * config_.period_s * torque_Nm[i],
                     -limit_Nm, limit_Nm);
    }
  Output output = drive_arm(spring, torque_Nm);
  output.wheel_torque_Nm = brake_base();
  return output;
}

void WholeBodyController::adopt_rest() noexcept {
  for (int i = 0; i < kArmJoints; ++i) {
    const double limit_Nm = config_.settling_limit_Nm[static_cast<std::size_t>(i)];
    settled_Nm_[i] = std::clamp(spring_share_Nm_[i], -limit_Nm, limit_Nm);
  }
}

WholeBodyController::Output WholeBodyController::drive_arm(const CartesianSpring::Output& spring,
                                                           const ArmVector& torque_Nm) noexcept {
  const ArmProtection::Output protection =
      protection_.torque(model_, state_.position.tail<kArmJoints>(), state_.velocity.tail<kArmJoints>());
  Output output;
  output.wrench_W = spring.wrench_W;
  output.spring_W_N = spring.spring_W_N;
  output.limited = spring.limited;
  output.protecting = protection.active;
  const ChainVector gravity = model_.gravity_Nm();
  for (int i = 0; i < kArmJoints; ++i) {
    const auto joint = static_cast<std::size_t>(i);
    const auto let_through = [&](double wanted_Nm) {
      return wanted_Nm * (wanted_Nm < 0 ? protection.share_downwards[i] : protection.share_upwards[i]);
    };
    const double command_Nm = let_through(torque_Nm[i]) + protection.torque_Nm[i];
    const double help_Nm =
        arm_compensator_.torque_Nm(command_Nm, arm_estimates_[joint], arm_observers_[joint]);
    const double limit_Nm = config_.arm_torque_limit_Nm[joint];
    const double whole_Nm = command_Nm + help_Nm + let_through(settled_Nm_[i]) + gravity[kBaseAxes + i];
    output.arm_torque_Nm[i] = std::clamp(whole_Nm, -limit_Nm, limit_Nm);
    // The part that remains with a slack spring is computed again each cycle.
    const double guard_Nm = protection.torque_Nm[i];
    const double staying_Nm =
        guard_Nm + arm_compensator_.torque_Nm(guard_Nm, arm_estimates_[joint], arm_observers_[joint]) +
        gravity[kBaseAxes + i];
    spring_share_Nm_[i] = output.arm_torque_Nm[i] - staying_Nm;
    output.limited = output.limited || std::abs(whole_Nm) > limit_Nm;
  }
  return output;
}

ArmVector WholeBodyController::lowering_torque_Nm(double share) noexcept {
  const Eigen::Map<const ArmVector> limit_Nm(config_.arm_torque_limit_Nm.data());
  const ArmVector torque_Nm = (1 - share) * model_.gravity_Nm().tail<kArmJoints>() -
                              kLoweringDamping.cwiseProduct(state_.velocity.tail<kArmJoints>());
  return torque_Nm.cwiseMax(-limit_Nm).cwiseMin(limit_Nm);
}

WheelVector WholeBodyController::brake_base() noexcept {
  const PlanarVector twist_B = rotated(PlanarVector(state_.velocity.head<kBaseAxes>()), -state_.X_WB.yaw_rad);
  return base_.drive_uncompensated(-kBrake.cwiseProduct(twist_B)).torque_Nm;
}

ArmVector WholeBodyController::posture_pull_Nm() const noexcept {
  const ArmVector pull_Nm =
      config_.posture_stiffness_Nm_per_rad * (posture_rad_ - state_.position.tail<kArmJoints>());
  return pull_Nm.cwiseMax(-config_.posture_torque_limit_Nm).cwiseMin(config_.posture_torque_limit_Nm) -
         config_.posture_damping_Nm_s_per_rad * state_.velocity.tail<kArmJoints>();
}

ChainVector WholeBodyController::posture_force() const noexcept {
  ChainVector wanted;
  wanted << -kBasePostureDamping.cwiseProduct(PlanarVector(state_.velocity.head<kBaseAxes>())),
      posture_pull_Nm();

  Mobility mobility = state_.mobility_W;
  // Where the arm cannot move the end effector, the inverse would require infinite forces.
  mobility.diagonal().array() += 1e-3;
  const Wrench at_tip_W = mobility.ldlt().solve(Wrench(response_.transpose() * wanted));
  return wanted - model_.J_WT().transpose() * at_tip_W;
}

}  // namespace control
