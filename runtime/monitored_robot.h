/// @file
/// A robot whose sensors are judged in every cycle.
#pragma once
#include "control/plausibility/plausibility_monitor.h"
#include "hal/robot_wrapper.h"

namespace runtime {

/// Passes everything on, and adds a fault where control::PlausibilityMonitor does not believe a sensor: as
/// any other it is latched until the robot is disabled, and the drives go off with the next exchange. Every
/// cycle puts it around its robot, so that none is without. One thread; cycle: exchange().
class MonitoredRobot final : public hal::RobotWrapper {
 public:
  using Wheels = control::PlausibilityMonitor::Wheels;

  /// `robot` outlives it.
  MonitoredRobot(hal::Robot& robot, Wheels wheels, const control::ChecksOff& off = {})
      : RobotWrapper(robot), monitor_(robot.joints(), wheels, off) {}

  hal::CycleStatus exchange(const hal::RobotCommand& command, hal::RobotSample& sample) noexcept override;

  /// Cycle: as control::PlausibilityMonitor says it.
  control::ChecksOff silent_checks() const noexcept { return monitor_.silent(); }
  /// Those that were silent at any time so far.
  control::ChecksOff once_silent_checks() const noexcept { return once_silent_; }

 private:
  control::PlausibilityMonitor monitor_;
  control::ChecksOff once_silent_;
  std::chrono::nanoseconds stamp_{};
  hal::CycleStatus latched_{};
};

}  // namespace runtime
