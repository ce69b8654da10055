#include "control/contact_observer.h"

#include <Eigen/Cholesky>
#include <algorithm>

#include "control/positive.h"

namespace control {
namespace {

/// Where the arm cannot feel a force, because no joint moves the end effector along it, the force is taken as
/// small: prior standard deviation of a force.
constexpr double kPrior_N = 100.0;

}  // namespace

ContactObserver::ContactObserver(const Config& config) : config_(config) {
  const RequirePositive require_positive{"contact observer"};
  require_positive(config.rate_per_s, "rate_per_s");
  require_positive(config.presliding_Nm_per_rad, "presliding_Nm_per_rad");
  for (const double uncertainty_Nm : config.uncertainty_Nm)
    require_positive(uncertainty_Nm, "uncertainty_Nm");
}

void ContactObserver::reset() noexcept {
  started_ = false;
  external_Nm_.setZero();
  force_W_N_.setZero();
}

void ContactObserver::step(const Input& input) noexcept {
  const double dt = input.elapsed_s;
  const ArmVector momentum = (input.mass * input.velocity).tail<kArmJoints>();
  if (!started_) {
    started_ = true;
    mass_ = input.mass;
    expected_ = momentum;
    position_rad_ = input.position_rad;
    friction_Nm_.setZero();
    return;
  }
  const ArmVector growth_Nm = ((input.mass - mass_) * input.velocity).tail<kArmJoints>() / dt;
  mass_ = input.mass;
  friction_Nm_ = (friction_Nm_ + config_.presliding_Nm_per_rad * (input.position_rad - position_rad_))
                     .cwiseMax(-input.sliding_Nm)
                     .cwiseMin(input.sliding_Nm);
  position_rad_ = input.position_rad;
  // A step longer than the observer's own time constant would overshoot.
  const double rate_per_s = std::min(config_.rate_per_s, 1 / dt);
  expected_ +=
      dt * (input.torque_Nm - friction_Nm_ + growth_Nm - input.coriolis_Nm - input.gravity_Nm + external_Nm_);
  external_Nm_ = rate_per_s * (momentum - expected_);

  const ArmVector weight = config_.uncertainty_Nm.cwiseAbs2().cwiseInverse();
  Eigen::Matrix3d information = input.J_WT * weight.asDiagonal() * input.J_WT.transpose();
  information.diagonal().array() += 1 / (kPrior_N * kPrior_N);
  force_W_N_ = information.ldlt().solve(input.J_WT * weight.cwiseProduct(external_Nm_));
  if (!external_Nm_.allFinite() || !force_W_N_.allFinite()) reset();
}

}  // namespace control
