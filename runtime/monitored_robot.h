/// @file
/// A robot whose sensors are checked in every cycle.
#pragma once
#include "control/plausibility/plausibility_monitor.h"
#include "hal/robot_wrapper.h"

namespace runtime {

/// Forwards everything, and adds a fault if control::PlausibilityMonitor rejects a sensor: like any other
/// fault it is latched until the robot is disabled, and the drives are switched off with the next exchange.
/// Every cycle wraps its robot in it. One thread; cycle: exchange().
class MonitoredRobot final : public hal::RobotWrapper {
 public:
  using Wheels = control::PlausibilityMonitor::Wheels;

  /// `robot` must outlive it. @throws as control::PlausibilityMonitor does.
  MonitoredRobot(hal::Robot& robot, Wheels wheels, const control::ChecksOff& off = {},
                 const control::ModelChanges& arm = {})
      : RobotWrapper(robot), monitor_(robot.joints(), wheels, off, arm) {}

  hal::CycleStatus exchange(const hal::RobotCommand& command, hal::RobotSample& sample) noexcept override;

  /// Cycle: see control::PlausibilityMonitor.
  control::ChecksOff silent_checks() const noexcept { return monitor_.silent(); }
  /// Checks that were silent at any time so far.
  control::ChecksOff once_silent_checks() const noexcept { return once_silent_; }

 private:
  control::PlausibilityMonitor monitor_;
  control::ChecksOff once_silent_;
  std::chrono::nanoseconds stamp_{};
  hal::CycleStatus latched_{};
};

}  // namespace runtime
