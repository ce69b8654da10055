#include "hal/loopback_robot.h"

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>

#include "hal/setup_error.h"

namespace hal {
namespace {

bool is_finite(const JointSample& joint) noexcept {
  return std::isfinite(joint.position_rad) && std::isfinite(joint.velocity_rad_per_s) &&
         std::isfinite(joint.torque_Nm);
}

bool all_finite(std::span<const JointSample> joints) noexcept {
  return std::all_of(joints.begin(), joints.end(), is_finite);
}

}  // namespace

LoopbackRobot::LoopbackRobot(Plant& plant, const Clock& clock, std::chrono::nanoseconds period,
                             std::vector<JointInfo> joints)
    : plant_(plant), clock_(clock), period_(period), joints_(std::move(joints)) {
  const auto count = static_cast<std::size_t>(plant.joint_count());
  if (joints_.size() != count || count > kMaxJoints)
    throw SetupError("loopback robot", "match names to joints",
                     std::to_string(joints_.size()) + " names for a plant with " + std::to_string(count) +
                         " joints (at most " + std::to_string(kMaxJoints) + ")");
  if (period_.count() <= 0) throw SetupError("loopback robot", "set the period", "it must be positive");
}

void LoopbackRobot::activate() {
  active_ = true;
  enabled_ = false;
  applied_ = {};
  latched_ = {};
  next_exchange_.reset();
}

void LoopbackRobot::deactivate() noexcept {
  active_ = false;
  enabled_ = false;
}

CycleStatus LoopbackRobot::exchange(const RobotCommand& command, RobotSample& sample) noexcept {
  if (!active_) {
    sample.enabled = false;
    return {Fault::kNotActive};
  }

  RobotSample measured;
  measured.stamp = measured.earliest = measured.latest = catch_up(clock_.now());
  plant_.measure(std::span(measured.joints).first(joints_.size()));

  if (!command.enable) latched_ = {};
  const CycleStatus measurement = check(measured);
  if (latched_.ok()) latched_ = measurement;
  if (latched_.ok()) latched_ = check(command);
  enabled_ = command.enable && latched_.ok();

  applied_ = enabled_ ? within_limits(command) : RobotCommand{};
  advance(period_);
  measured.enabled = enabled_;
  if (!all_finite(std::span(measured.joints).first(joints_.size())))
    sample.enabled = enabled_;  // values and stamp keep their old values
  else
    sample = measured;
  return latched_;
}

void LoopbackRobot::advance(std::chrono::nanoseconds duration) noexcept {
  plant_.advance(std::span(applied_.joints).first(joints_.size()), enabled_, duration);
}

std::chrono::nanoseconds LoopbackRobot::catch_up(std::chrono::nanoseconds now) noexcept {
  // Simulated and real time stay in step on average: a wake-up that is late by less than a period is jitter,
  // and its delay is not counted again by the next one.
  const std::chrono::nanoseconds expected = next_exchange_.value_or(now);
  const auto skipped = std::clamp<std::int64_t>((now - expected) / period_, 0, kMaxPeriods - 1);
  if (skipped > 0) advance(skipped * period_);
  const bool lost_the_thread = now - expected >= kMaxPeriods * period_ || now < expected - period_;
  const std::chrono::nanoseconds simulated = lost_the_thread ? now : expected + skipped * period_;
  next_exchange_ = simulated + period_;
  return simulated;
}

RobotCommand LoopbackRobot::within_limits(RobotCommand command) const noexcept {
  for (std::size_t i = 0; i < joints_.size(); ++i) {
    const double limit_rad_per_s = joints_[i].speed_limit_rad_per_s;
    JointCommand& joint = command.joints[i];
    if (joint.mode == CommandMode::kVelocity)
      joint.target = std::clamp(joint.target, -limit_rad_per_s, limit_rad_per_s);
  }
  return command;
}

CycleStatus LoopbackRobot::check(const RobotCommand& command) const noexcept {
  for (std::size_t i = 0; i < joints_.size(); ++i)
    if (!std::isfinite(command.joints[i].target))
      return {Fault::kBadCommand, static_cast<std::int8_t>(i),
              static_cast<std::uint32_t>(command.joints[i].mode)};
  return {};
}

CycleStatus LoopbackRobot::check(const RobotSample& sample) const noexcept {
  for (std::size_t i = 0; i < joints_.size(); ++i) {
    const JointSample& joint = sample.joints[i];
    const JointFault fault = is_finite(joint) ? joint.fault : JointFault::kBadSample;
    if (fault != JointFault::kNone)
      return {Fault::kJointFault, static_cast<std::int8_t>(i), static_cast<std::uint32_t>(fault)};
  }
  return {};
}

}  // namespace hal
