#include "apps/youbot_bench/arm_motion_task.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <string>
#include <utility>

#include "hal/seconds.h"
#include "identification/experiments/rehearsal.h"

namespace youbot_bench {
namespace {

using runtime::Moment;
using runtime::StopReason;
using runtime::Verdict;

/// Of the position's error: well below the drives' velocity loops.
constexpr double kFollowing_per_s = 5.0;
constexpr double kFollowingFilter_rad_per_s = 125.0;
/// A drive that obeys stays within it.
constexpr double kFollowingError_rad = 0.2;
/// One that seems blocked, although it is not farther off, carries weight where its motion reverses.
constexpr double kOnItsWay_rad = 0.05;

constexpr const char* kTourNotHomed =
    "{joint} does not know its zero: home the arm first, by home_arms in [ethercat] of --config; drives "
    "switched off";
constexpr const char* kTourNearStop =
    "{joint} came near the end of its range, at {value:.3f} rad; braked, then switched off";
constexpr const char* kTourTorque =
    "{joint} took {value:.2f} N·m, more than the {limit:.3g} N·m it is made for; braked, then switched off";
constexpr const char* kTourBlocked =
    "{joint} is blocked: it took {value:.2f} N·m and did not turn; braked, then switched off";
constexpr const char* kTourBehind =
    "{joint} is {value:.2f} rad off its motion, more than {limit:.2g} rad; braked, then switched off";

}  // namespace

std::array<std::size_t, control::kArmJoints> ArmMotionTask::arm_joints(
    std::span<const hal::JointInfo> joints) {
  std::array<std::size_t, control::kArmJoints> indices{};
  for (std::size_t i = 0; i < indices.size(); ++i) {
    const auto found = std::ranges::find(joints, "arm-" + std::to_string(i + 1), &hal::JointInfo::name);
    if (found == joints.end())
      throw std::invalid_argument("--kind: this robot has no arm with joints arm-1 to arm-5");
    indices[i] = static_cast<std::size_t>(found - joints.begin());
  }
  return indices;
}

ArmMotionTask::ArmMotionTask(const Config& config, const hal::Robot& robot, ArmTour tour,
                             ArmMotionRecording& recording)
    : config_(config), infos_(robot.joints()), tour_(std::move(tour)), recording_(recording) {
  const double period_s = hal::seconds(config.period);
  const control::StateVariableFilter filter(
      {.cutoff_rad_per_s = kFollowingFilter_rad_per_s, .period_s = period_s});
  for (const std::size_t index : arm_joints(infos_))
    joints_.push_back({index, filter, JointGuard(infos_[index], period_s)});
}

void ArmMotionTask::read(const Moment& moment) noexcept {
  if (!moves(moment.phase)) return;
  for (Joint& joint : joints_) {
    const hal::JointSample& sample = moment.sample.joints[joint.index];
    joint.reading.position_rad = sample.position_rad;
    joint.reading.velocity_rad_per_s = joint.filter.step(sample.position_rad).velocity;
    joint.reading.torque_Nm = sample.torque_Nm;
  }
}

Verdict ArmMotionTask::begin(const Moment& moment, hal::RobotCommand& command) noexcept {
  control::ArmVector start_rad;
  for (std::size_t i = 0; i < joints_.size(); ++i) {
    const hal::JointSample& sample = moment.sample.joints[joints_[i].index];
    if (!sample.homed)
      return {.next = Verdict::Next::kFail,
              .reason = {.kind = StopReason::Kind::kMisfit,
                         .text = kTourNotHomed,
                         .joint = static_cast<int>(joints_[i].index)}};
    joints_[i].filter.reset(sample.position_rad);
    joints_[i].reading = {.position_rad = sample.position_rad, .torque_Nm = sample.torque_Nm};
    start_rad[static_cast<Eigen::Index>(i)] = sample.position_rad;
  }
  tour_.start_at(start_rad);
  begin_ = moment.now;
  wanted_ = tour_.at(0);
  return step(moment, command);
}

Verdict ArmMotionTask::step(const Moment& moment, hal::RobotCommand& command) noexcept {
  const hal::RobotSample& sample = moment.sample;
  time_s_ = hal::seconds(moment.now - begin_);
  wanted_ = tour_.at(time_s_);
  ArmMotionRecord record{.time_s = wanted_.time_s, .motion = wanted_.motion};
  for (std::size_t i = 0; i < infos_.size(); ++i)
    command.joints[i] = hal::JointCommand::velocity_rad_per_s(0);
  for (std::size_t i = 0; i < joints_.size(); ++i) {
    Joint& joint = joints_[i];
    const auto at = static_cast<Eigen::Index>(i);
    const double behind_rad = wanted_.position_rad[at] - joint.reading.position_rad;
    if (const StopReason reason = watch(joint, behind_rad, moment.sent))
      return {.next = Verdict::Next::kBrake, .reason = reason};
    const double limit = infos_[joint.index].speed_limit_rad_per_s;
    command.joints[joint.index] = hal::JointCommand::velocity_rad_per_s(
        std::clamp(wanted_.velocity_rad_per_s[at] + kFollowing_per_s * behind_rad, -limit, limit));
    record.position_rad[i] = sample.joints[joint.index].position_rad;
    record.position_command_rad[i] = wanted_.position_rad[at];
    record.torque_Nm[i] = sample.joints[joint.index].torque_Nm;
  }
  if (record.motion >= 0) {
    if (config_.wait_for_recording) recording_.wait_for_room();
    recording_.add(record);
  }
  return {.next = time_s_ < tour_.duration_s() ? Verdict::Next::kGoOn : Verdict::Next::kBrake};
}

/// Fault in its motion, if any.
StopReason ArmMotionTask::watch(Joint& joint, double behind_rad, const hal::RobotCommand& sent) noexcept {
  const int index = static_cast<int>(joint.index);
  if (!(std::abs(behind_rad) <= kFollowingError_rad))
    return {.kind = StopReason::Kind::kBehind,
            .text = kTourBehind,
            .joint = index,
            .value = behind_rad,
            .limit = kFollowingError_rad};
  const JointGuard::Trip trip = joint.guard.watch(joint.reading, sent.joints[joint.index]);
  const double torque_Nm = joint.guard.torque_Nm();
  switch (trip) {
    case JointGuard::Trip::kNone: break;
    case JointGuard::Trip::kNearStop:
      return {.kind = StopReason::Kind::kNearStop,
              .text = kTourNearStop,
              .joint = index,
              .value = joint.reading.position_rad};
    case JointGuard::Trip::kTorque:
      return {.kind = StopReason::Kind::kTorque,
              .text = kTourTorque,
              .joint = index,
              .value = torque_Nm,
              .limit = infos_[joint.index].rated_torque_Nm};
    case JointGuard::Trip::kBlocked:
      if (std::abs(behind_rad) < kOnItsWay_rad) break;
      return {.kind = StopReason::Kind::kBlocked, .text = kTourBlocked, .joint = index, .value = torque_Nm};
  }
  return {};
}

Verdict ArmMotionTask::brake(const Moment& moment, hal::RobotCommand& command,
                             double& fastest_rad_per_s) noexcept {
  const double period_s = hal::seconds(config_.period);
  fastest_rad_per_s = 0.0;
  for (std::size_t i = 0; i < infos_.size(); ++i)
    command.joints[i] = hal::JointCommand::velocity_rad_per_s(0);
  for (const Joint& joint : joints_) {
    const hal::JointCommand& last = moment.sent.joints[joint.index];
    const double last_rad_per_s =
        last.mode == hal::CommandMode::kVelocity ? last.target : joint.reading.velocity_rad_per_s;
    command.joints[joint.index].target = identification::experiments::gently(last_rad_per_s, 0, period_s);
    const double speed_rad_per_s = std::abs(joint.reading.velocity_rad_per_s);
    // NaN: nothing shows that it rests.
    fastest_rad_per_s =
        std::max(fastest_rad_per_s,
                 std::isnan(speed_rad_per_s) ? std::numeric_limits<double>::infinity() : speed_rad_per_s);
  }
  return {};
}

}  // namespace youbot_bench
