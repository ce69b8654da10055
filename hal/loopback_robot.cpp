#include "hal/loopback_robot.h"

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>

#include "hal/setup_error.h"

namespace hal {

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
  last_exchange_.reset();
}

void LoopbackRobot::deactivate() noexcept {
  active_ = false;
  enabled_ = false;
}

CycleStatus LoopbackRobot::exchange(const RobotCommand& command, RobotSample& sample) noexcept {
  if (!active_) return {Fault::kNotActive};

  RobotSample measured;
  measured.stamp = clock_.now();
  catch_up(measured.stamp);
  plant_.measure(std::span(measured.joints).first(joints_.size()));

  if (!command.enable) latched_ = {};
  const CycleStatus measurement = check(measured);
  if (latched_.ok()) latched_ = measurement;
  if (latched_.ok()) latched_ = check(command);
  enabled_ = command.enable && latched_.ok();

  applied_ = enabled_ ? command : RobotCommand{};
  advance(period_);
  measured.enabled = enabled_;
  if (measurement.detail == static_cast<std::uint32_t>(JointFault::kBadSample))
    sample.enabled = enabled_;  // the values stay as they were, and so does their stamp
  else
    sample = measured;
  return latched_;
}

void LoopbackRobot::advance(std::chrono::nanoseconds duration) noexcept {
  plant_.advance(std::span(applied_.joints).first(joints_.size()), enabled_, duration);
}

void LoopbackRobot::catch_up(std::chrono::nanoseconds now) noexcept {
  const std::chrono::nanoseconds since = now - last_exchange_.value_or(now);
  last_exchange_ = now;
  // A wake-up that is late by less than half a period is jitter, not a skipped cycle.
  const auto skipped = (since - period_ / 2) / period_;
  if (skipped > 0) advance(std::min<std::int64_t>(skipped, kMaxPeriods - 1) * period_);
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
    const bool finite = std::isfinite(joint.position_rad) && std::isfinite(joint.velocity_rad_per_s) &&
                        std::isfinite(joint.torque_Nm);
    const JointFault fault = finite ? joint.fault : JointFault::kBadSample;
    if (fault != JointFault::kNone)
      return {Fault::kJointFault, static_cast<std::int8_t>(i), static_cast<std::uint32_t>(fault)};
  }
  return {};
}

}  // namespace hal
