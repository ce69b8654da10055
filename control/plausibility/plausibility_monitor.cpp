#include "control/plausibility/plausibility_monitor.h"

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <string_view>
#include <utility>

namespace control {
namespace {

/// Share of the torque limit: 0.2 N·m at a wheel, which bends the sticking contact by ten counts. Far more
/// than one count, because the floor may briefly cancel the motor's torque.
constexpr double kWheelStirring = 0.08;
/// An arm joint has no contact with the floor, and its encoder resolves three to six times as finely.
constexpr double kArmStirring = 0.04;
/// Wheels turn at up to 16 rad/s, arm joints at up to 1.6.
constexpr double kWheelBias_rad_per_s = 0.02;
constexpr double kArmBias_rad_per_s = 0.005;
constexpr double kWheelStep_rad_per_s = 0.5;
constexpr double kArmStep_rad_per_s = 0.25;
/// A fraction of an electrical revolution, 30 mrad of a wheel and 4 to 14 mrad of an arm joint: Hall sensors
/// do not see a count that is off by whole revolutions. In a millisecond no torque moves a joint and stops it
/// again over such a distance.
constexpr double kWheelJump_rad = 0.004;
constexpr double kArmJump_rad = 0.0015;
/// Share of the torque limit: the current reading of the wheel in the thesis is off by 35 mA of 2.85 A. Arm
/// joint 5 has 1 A.
constexpr double kWheelTorqueBias = 0.015;
constexpr double kArmTorqueBias = 0.045;
/// (k_t·g)²/R · T of TorqueAgreement, with 0.0335 N·m/A and 0.978 Ω from the data sheet and T = 2 ms at a
/// wheel; in the arm T is 1 ms at joints 1 and 2, and 2 ms or more at the others.
constexpr double kWheelBlow_Nm_s2_per_rad = 0.0015;
constexpr double kArmBlow_Nm_s2_per_rad = 0.028;

/// A busy computer is occasionally late for a moment.
constexpr double kSilent_s = 1.0;
/// After a lost request, a mailbox answers the next one after slightly more than a second.
constexpr double kUnread_s = 2.5;
/// Interval with one missing sample.
constexpr double kOneMissing_s = kRegularSample_s + 0.001;
/// A step of velocity is visible only between samples whose times are known this well.
constexpr double kUnsureStep_s = kRegularSample_s - kAllowed_s;

constexpr std::size_t kWheels = 4;

bool is_wheel(const hal::JointInfo& joint) noexcept { return joint.name.starts_with("wheel"); }

WheelVector wheels_of(const hal::RobotSample& sample, double hal::JointSample::*value) noexcept {
  WheelVector values;
  for (Eigen::Index i = 0; i < values.size(); ++i)
    values[i] = sample.joints[static_cast<std::size_t>(i)].*value;
  return values;
}

}  // namespace

PlausibilityMonitor::PlausibilityMonitor(std::span<const hal::JointInfo> joints, Wheels wheels,
                                         const ChecksOff& off, const ModelChanges& arm)
    : off_(off) {
  for (const hal::JointInfo& info : joints) {
    const bool wheel = is_wheel(info);
    joints_.push_back({StillEncoder((wheel ? kWheelStirring : kArmStirring) * info.torque_limit_Nm),
                       VelocityAgreement(wheel ? kWheelBias_rad_per_s : kArmBias_rad_per_s),
                       TorqueAgreement(info.torque_limit_Nm,
                                       (wheel ? kWheelTorqueBias : kArmTorqueBias) * info.torque_limit_Nm,
                                       wheel ? kWheelBlow_Nm_s2_per_rad : kArmBlow_Nm_s2_per_rad),
                       VelocityStep(wheel ? kWheelStep_rad_per_s : kArmStep_rad_per_s,
                                    wheel ? kWheelJump_rad : kArmJump_rad)});
  }
  const bool base =
      joints.size() >= kWheels && std::all_of(joints.begin(), joints.begin() + kWheels, is_wheel);
  if (base && wheels == Wheels::kRolling && !off.has(PlausibilityCheck::kWheelAgreement))
    wheels_.emplace().restart();
  if (base && !off.has(PlausibilityCheck::kHallAgreement)) senses_.emplace();
  if (base && wheels == Wheels::kRolling && !off.has(PlausibilityCheck::kOpposedMotion))
    driven_back_.emplace(joints.front().torque_limit_Nm);
  if (!base || joints.size() != kWheels + kArmJoints || off.has(PlausibilityCheck::kOpposedMotion)) return;
  arm_.emplace(Arm{RobotModel(arm), {}});
  for (const hal::JointInfo& joint : joints) arm_->joints.emplace_back(joint.torque_limit_Nm);
}

void PlausibilityMonitor::restart() noexcept {
  for (Joint& joint : joints_) {
    joint.still.restart();
    joint.velocity.restart();
    joint.torque.restart();
    joint.step.restart();
    joint.hall.restart();
    joint.away.restart();
  }
  if (wheels_) wheels_->restart();
  if (senses_) senses_->restart();
  if (driven_back_) driven_back_->restart();
  if (arm_)
    for (OpposedMotion& joint : arm_->joints) joint.restart();
}

std::optional<PlausibilityMonitor::Finding> PlausibilityMonitor::update(const hal::RobotCommand& command,
                                                                        const hal::RobotSample& sample,
                                                                        double elapsed_s) noexcept {
  const std::chrono::duration<double> bounds = sample.latest - sample.earliest;
  const SampleTime time{elapsed_s, bounds.count()};
  late_s_ = time.unsure_s() > 0 ? late_s_ + elapsed_s : 0.0;
  without_steps_s_ += elapsed_s;
  // Late answers say nothing about how the robot is set up.
  if (elapsed_s > kRegularSample_s && time.unsure_s() <= 0)
    irregular_s_ += elapsed_s;
  else if (elapsed_s > 0 && elapsed_s <= kRegularSample_s)
    irregular_s_ = 0.0;
  if (elapsed_s > kComparable_s || time.unsure_s() > kComparable_s) {
    restart();
    return std::nullopt;
  }
  for (std::size_t i = 0; i < joints_.size(); ++i) joints_[i].torque.command(command.joints[i]);
  if (!(elapsed_s > 0)) return std::nullopt;
  const bool follows_regular = std::exchange(last_elapsed_s_, elapsed_s) <= kRegularSample_s;
  regular_ =
      time.unsure_s() <= kUnsureStep_s && elapsed_s <= (follows_regular ? kOneMissing_s : kRegularSample_s);
  std::optional<Finding> finding;
  for (std::size_t i = 0; i < joints_.size(); ++i) {
    const hal::JointFault fault = check(joints_[i], command.joints[i], sample.joints[i], time);
    if (fault != hal::JointFault::kNone && !finding) finding = {fault, static_cast<int>(i)};
    if (joints_[i].step.full()) without_steps_s_ = 0.0;
  }
  if (!finding) finding = check_senses(time.elapsed_s);
  if (wheels_) {
    const std::optional<int> wheel = wheels_->update(wheels_of(sample, &hal::JointSample::position_rad),
                                                     wheels_of(sample, &hal::JointSample::torque_Nm), time);
    if (wheel && !finding)
      finding = {hal::JointFault::kWheelsDisagree, *wheel >= 0 ? *wheel : suspect_wheel()};
  }
  if (arm_) {
    const std::optional<Finding> opposed = check_arm(command, sample, time);
    if (!finding) finding = opposed;
  }
  if (driven_back_) {
    const std::optional<Finding> base = check_base(command, sample, time.elapsed_s);
    if (!finding) finding = base;
  }
  return finding;
}

std::optional<PlausibilityMonitor::Finding> PlausibilityMonitor::check_senses(double elapsed_s) noexcept {
  if (!senses_) return std::nullopt;
  std::array<int, kWheels> senses{};
  for (std::size_t i = 0; i < kWheels; ++i) senses[i] = joints_[i].hall.sense();
  const std::optional<int> wheel = senses_->update(senses, elapsed_s);
  if (!wheel) return std::nullopt;
  return Finding{hal::JointFault::kHallSensesDiffer, *wheel};
}

std::optional<PlausibilityMonitor::Finding> PlausibilityMonitor::check_base(const hal::RobotCommand& command,
                                                                            const hal::RobotSample& sample,
                                                                            double elapsed_s) noexcept {
  WheelVector torque_Nm;
  for (std::size_t i = 0; i < kWheels; ++i) {
    // In the other modes the drive chooses its torque.
    if (command.joints[i].mode != hal::CommandMode::kTorque) {
      driven_back_->restart();
      return std::nullopt;
    }
    torque_Nm[static_cast<Eigen::Index>(i)] = command.joints[i].target;
  }
  double arm_J = 0.0;
  if (arm_)
    for (std::size_t i = kWheels; i < arm_->joints.size(); ++i) arm_J += arm_->joints[i].put_in_J();
  if (!driven_back_->update(wheels_of(sample, &hal::JointSample::position_rad), torque_Nm, arm_J, elapsed_s))
    return std::nullopt;
  return Finding{hal::JointFault::kBaseDrivenBack, -1};
}

/// The only wheel whose Hall sensors contradict its encoder, though not yet often enough for a finding of
/// their own. -1: none, or several.
int PlausibilityMonitor::suspect_wheel() const noexcept {
  if (off_.has(PlausibilityCheck::kHallAgreement)) return -1;
  const auto wheels = std::span(joints_).first(kWheels);
  const auto contradicted = [](const Joint& joint) { return joint.hall.contradicted(); };
  if (std::ranges::count_if(wheels, contradicted) != 1) return -1;
  return static_cast<int>(std::ranges::find_if(wheels, contradicted) - wheels.begin());
}

ChecksOff PlausibilityMonitor::silent() const noexcept {
  ChecksOff silent;
  if (late_s_ >= kSilent_s && wheels_) silent.add(PlausibilityCheck::kWheelAgreement);
  if (late_s_ >= kSilent_s && arm_) silent.add(PlausibilityCheck::kOpposedMotion);
  // A robot that is configured to sample irregularly reports that in its own notes.
  if (without_steps_s_ >= kSilent_s && irregular_s_ < kSilent_s &&
      !off_.has(PlausibilityCheck::kVelocityStep))
    silent.add(PlausibilityCheck::kVelocityStep);
  const auto unread = [](const Joint& joint) { return joint.hall.without_reading_s() >= kUnread_s; };
  if (std::ranges::any_of(joints_, unread) && !off_.has(PlausibilityCheck::kHallAgreement))
    silent.add(PlausibilityCheck::kHallAgreement);
  return silent;
}

std::optional<PlausibilityMonitor::Finding> PlausibilityMonitor::check_arm(const hal::RobotCommand& command,
                                                                           const hal::RobotSample& sample,
                                                                           const SampleTime& time) noexcept {
  ChainVector q = ChainVector::Zero();  // the weight does not depend on the base's pose
  for (std::size_t i = 0; i < kArmJoints; ++i)
    q[kBaseAxes + static_cast<Eigen::Index>(i)] = sample.joints[kWheels + i].position_rad;
  arm_->model.update(q);
  const ChainVector weight_Nm = arm_->model.gravity_Nm();
  const bool hall = !off_.has(PlausibilityCheck::kHallAgreement);
  double put_in_J = 0.0;
  for (std::size_t i = 0; i < arm_->joints.size(); ++i) {
    const bool wheel = i < kWheels;
    const hal::JointSample& joint = sample.joints[i];
    // Before homing, the angle does not determine the weight; in other modes the drive chooses its torque.
    if (!(wheel || joint.homed) || command.joints[i].mode != hal::CommandMode::kTorque)
      arm_->joints[i].restart();
    else
      arm_->joints[i].update(joint.position_rad, command.joints[i].target,
                             wheel ? 0.0 : weight_Nm[kBaseAxes + static_cast<Eigen::Index>(i - kWheels)],
                             hall ? joints_[i].hall.sense() : 0, time);
    put_in_J += arm_->joints[i].put_in_J();
  }
  for (std::size_t i = kWheels; i < arm_->joints.size(); ++i)
    if (arm_->joints[i].opposed(put_in_J - arm_->joints[i].put_in_J()))
      return Finding{hal::JointFault::kOpposedMotion, static_cast<int>(i)};
  return std::nullopt;
}

hal::JointFault PlausibilityMonitor::check(Joint& joint, const hal::JointCommand& command,
                                           const hal::JointSample& sample,
                                           const SampleTime& time) const noexcept {
  // NaN would pass every comparison below and stay in the filters.
  if (!std::isfinite(sample.position_rad) || !std::isfinite(sample.velocity_rad_per_s) ||
      !std::isfinite(sample.torque_Nm))
    return hal::JointFault::kBadSample;
  // A step of velocity is visible only in regular samples, without two missing in a row.
  if (!regular_) joint.step.restart();
  // Update all of them each time: none may miss a sample.
  const bool still = joint.still.update(command, sample, time);
  const bool velocity = joint.velocity.update(sample.position_rad, sample.velocity_rad_per_s, time);
  const bool torque = joint.torque.update(sample.position_rad, sample.torque_Nm, time.elapsed_s);
  const bool step = joint.step.update(sample.position_rad, time);
  const bool hall = joint.hall.update(sample.rotor, time.elapsed_s);
  const bool away = joint.away.update(command, sample.position_rad, time);
  const auto on = [this](PlausibilityCheck check) { return !off_.has(check); };
  // First the check that identifies the joint whatever else is wrong.
  if (hall && on(PlausibilityCheck::kHallAgreement)) return hal::JointFault::kHallDisagrees;
  if (still && on(PlausibilityCheck::kStillEncoder)) return hal::JointFault::kEncoderStill;
  if (velocity && on(PlausibilityCheck::kVelocityAgreement)) return hal::JointFault::kVelocityDisagrees;
  if (step && on(PlausibilityCheck::kVelocityStep)) return hal::JointFault::kVelocityStep;
  if (torque && on(PlausibilityCheck::kTorqueAgreement)) return hal::JointFault::kTorqueDisagrees;
  if (away && on(PlausibilityCheck::kAwayFromTarget)) return hal::JointFault::kAwayFromTarget;
  return hal::JointFault::kNone;
}

}  // namespace control
