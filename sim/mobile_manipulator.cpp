#include "sim/mobile_manipulator.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>

#include "hal/seconds.h"

namespace sim {
namespace {

using hal::seconds;

using control::kArmJoints;
using control::kBaseAxes;
using control::kChainAxes;

/// The motor controllers' loops run at 1 kHz (TMCL axis parameter 133).
constexpr std::chrono::nanoseconds kControllerPeriod{1'000'000};
/// For the fastest oscillation. It is unstable from 2 on; with the default step, joint 5 on its gear has 0.1.
constexpr double kLongestStep_rad = 0.5;

MobileManipulatorParameters checked(const MobileManipulatorParameters& parameters) {
  const auto require_positive = [](std::chrono::nanoseconds value, const char* name) {
    if (value.count() <= 0)
      throw std::invalid_argument(std::string("simulated robot: ") + name + " must be positive, not " +
                                  std::to_string(value.count()) + " ns");
  };
  require_positive(parameters.step, "step");
  require_positive(parameters.model_hold, "model_hold");
  return parameters;
}

control::ChainVector chain(const control::ArmVector& arm_rad) {
  control::ChainVector q;
  q << 0, 0, 0, arm_rad;
  return q;
}

}  // namespace

control::ModelChanges built_robot() {
  control::ModelChanges changes;
  changes.links = {{{1.03, {0.004, -0.003, 0.002}},
                    {0.97, {-0.003, 0.002, 0.001}},
                    {1.04, {0.002, -0.001, 0.004}},
                    {1.05, {0.003, 0.001, -0.004}},
                    {0.96, {-0.002, 0.002, 0.004}},
                    {1.05, {0.001, -0.002, 0.003}}}};
  return changes;
}

MobileManipulator::MobileManipulator(const MobileManipulatorParameters& parameters,
                                     const EnvironmentParameters& environment)
    : parameters_(checked(parameters)),
      model_(parameters.masses),
      q_(chain(parameters.start_rad)),
      wheels_(parameters.wheels, model_.total_mass_kg()),
      joints_(make_joints()),
      environment_(environment) {
  wheels_.require_stable(seconds(parameters_.step));
  held_.v = v_;
  look_at_tip();
}

std::array<ElasticJoint, kArmJoints> MobileManipulator::make_joints() {
  model_.update(control::ChainVector::Zero());
  const control::ChainMatrix inverse = inverse_mass(model_.mass());
  const auto make = [&](int index) {
    const auto i = static_cast<std::size_t>(index);
    const Eigen::Index axis = kBaseAxes + index;
    // Rotors are fixed while gear and stops oscillate the links; folded, whatever the start pose.
    const double link_kg_m2 = 1 / inverse(axis, axis);
    const double longest_s = kLongestStep_rad / std::sqrt(parameters_.gear.stiffness_Nm_per_rad / link_kg_m2);
    if (seconds(parameters_.step) > longest_s)
      throw std::invalid_argument("simulated robot: step must be at most " + std::to_string(1e6 * longest_s) +
                                  " us for the gear of arm joint " + std::to_string(index + 1) + ", not " +
                                  std::to_string(1e6 * seconds(parameters_.step)));
    return ElasticJoint(index + 1, parameters_.arm[i], parameters_.gear, link_kg_m2,
                        parameters_.start_rad[index],
                        parameters_.wheels.noise_seed + MecanumWheels::kCount + 1 + i);
  };
  return {make(0), make(1), make(2), make(3), make(4)};
}

void MobileManipulator::measure(std::span<hal::JointSample> samples) noexcept {
  wheels_.measure(samples.first<MecanumWheels::kCount>());
  std::transform(joints_.begin(), joints_.end(), samples.begin() + MecanumWheels::kCount,
                 [](const ElasticJoint& joint) { return joint.measured(); });
}

void MobileManipulator::advance(std::span<const hal::JointCommand> commands, bool powered,
                                std::chrono::nanoseconds duration) noexcept {
  if (duration.count() <= 0) return;
  const double duration_s = seconds(duration);
  contact_impulse_W_N_s_.setZero();
  while (duration.count() > 0) {
    const std::chrono::nanoseconds period = std::min(duration, kControllerPeriod);
    const double period_s = seconds(period);
    wheels_.control(commands.first<MecanumWheels::kCount>(), powered, period_s);
    for (std::size_t i = 0; i < joints_.size(); ++i)
      joints_[i].control(commands[MecanumWheels::kCount + i], powered, period_s);
    const auto steps = (period.count() + parameters_.step.count() - 1) / parameters_.step.count();
    const double step_s = period_s / static_cast<double>(steps);
    for (std::int64_t n = 0; n < steps; ++n) step(step_s);
    wheels_.sense(period_s);
    for (ElasticJoint& joint : joints_) joint.sense(period_s);
    duration -= period;
  }
  contact_force_W_N_ = contact_impulse_W_N_s_ / duration_s;
  look_at_tip();
}

void MobileManipulator::set_on_ground(bool on_ground) noexcept {
  if (wheels_.on_ground() == on_ground) return;
  wheels_.set_on_ground(on_ground);
  if (!on_ground) v_.head<kBaseAxes>().setZero();
  held_.left_s = 0.0;  // the inverse mass changes
}

void MobileManipulator::step(double step_s) noexcept {
  if (held_.left_s < step_s / 2) hold_model(std::max(step_s, seconds(parameters_.model_hold)));
  held_.left_s -= step_s;

  const Eigen::Vector3d p_WT_m = held_.p_WT_m + held_.tip_jacobian * (q_ - held_.q);
  const Eigen::Vector3d v_WT_m_per_s = held_.tip_jacobian * v_;
  const Eigen::Vector3d contact_W_N = environment_.step(p_WT_m, v_WT_m_per_s, step_s);
  contact_impulse_W_N_s_ += step_s * contact_W_N;

  control::ChainVector torque = held_.tip_jacobian.transpose() * (contact_W_N + push_W_N_) - held_.bias_Nm;
  control::PlanarVector wrench_B = control::PlanarVector::Zero();
  const double cosine = std::cos(q_[2]);
  const double sine = std::sin(q_[2]);
  wheels_.step(pose(), control::rotated(v_.head<kBaseAxes>(), cosine, -sine), step_s, wrench_B);
  torque.head<kBaseAxes>() += control::rotated(wrench_B, cosine, sine);
  for (std::size_t i = 0; i < joints_.size(); ++i) {
    const auto axis = static_cast<Eigen::Index>(kBaseAxes + i);
    torque[axis] += joints_[i].step(q_[axis], v_[axis], step_s);
  }
  v_ += step_s * (held_.inverse_mass * torque);
  q_ += step_s * v_;
}

void MobileManipulator::hold_model(double duration_s) noexcept {
  held_.left_s = duration_s;
  held_.q = q_ + 0.5 * duration_s * v_;
  // Extrapolates the last change to the middle.
  const control::ChainVector v_middle = v_ + 0.5 * (v_ - held_.v);
  held_.v = v_;
  model_.update(held_.q);
  held_.inverse_mass = inverse_mass(model_.mass());
  held_.bias_Nm = model_.coriolis_Nm(v_middle) + model_.gravity_Nm();
  held_.tip_jacobian = model_.J_WT().topRows<3>();
  held_.p_WT_m = model_.X_WT().translation();
}

control::ChainMatrix MobileManipulator::inverse_mass(const control::ChainMatrix& mass) const noexcept {
  if (base_moves()) return mass.llt().solve(control::ChainMatrix::Identity());
  // No force moves a fixed axis.
  control::ChainMatrix inverse = control::ChainMatrix::Zero();
  inverse.bottomRightCorner<kArmJoints, kArmJoints>() =
      mass.bottomRightCorner<kArmJoints, kArmJoints>().llt().solve(
          Eigen::Matrix<double, kArmJoints, kArmJoints>::Identity());
  return inverse;
}

void MobileManipulator::look_at_tip() noexcept {
  model_.update(q_);
  X_WT_ = model_.X_WT();
  v_WT_m_per_s_ = model_.J_WT().topRows<3>() * v_;
}

control::PlanarVector MobileManipulator::twist() const noexcept {
  return control::rotated(v_.head<kBaseAxes>(), -q_[2]);
}

double MobileManipulator::kinetic_energy_J() noexcept {
  model_.update(q_);
  double energy_J = wheels_.kinetic_energy_J() + 0.5 * v_.dot(model_.mass() * v_);
  for (const ElasticJoint& joint : joints_) energy_J += joint.kinetic_energy_J();
  return energy_J;
}

double MobileManipulator::potential_energy_J() noexcept {
  // The work of lifting the arm along a straight line in its angles: Gauss-Legendre quadrature with three
  // points in each part; this number of parts is accurate to a microjoule.
  constexpr int kParts = 32;
  constexpr std::array<double, 3> kPoint{-0.7745966692414834, 0.0, 0.7745966692414834};
  constexpr std::array<double, 3> kWeight{5.0 / 9, 8.0 / 9, 5.0 / 9};
  const control::ChainVector way = chain(arm_rad());
  double energy_J = 0.0;
  for (int part = 0; part < kParts; ++part)
    for (std::size_t i = 0; i < kPoint.size(); ++i) {
      model_.update((part + 0.5 + 0.5 * kPoint[i]) / kParts * way);
      energy_J += kWeight[i] / (2 * kParts) * model_.gravity_Nm().dot(way);
    }
  for (std::size_t i = 0; i < joints_.size(); ++i)
    energy_J += joints_[i].elastic_energy_J(q_[static_cast<Eigen::Index>(kBaseAxes + i)]);
  return energy_J;
}

double MobileManipulator::arm_motor_work_J() const noexcept {
  double work_J = 0.0;
  for (const ElasticJoint& joint : joints_) work_J += joint.motor_work_J();
  return work_J;
}

}  // namespace sim
