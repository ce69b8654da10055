/// @file
/// A robot whose sensors are judged in every cycle.
#pragma once
#include "control/plausibility/plausibility_monitor.h"
#include "hal/robot.h"

namespace apps {

/// Passes everything on, and adds a fault where control::PlausibilityMonitor does not believe a sensor: as
/// any other it is latched until the robot is disabled, and the drives go off with the next exchange. Every
/// cycle puts it around its robot, so that none is without. One thread; cycle: exchange().
class MonitoredRobot final : public hal::Robot {
 public:
  /// `robot` outlives it.
  MonitoredRobot(hal::Robot& robot, control::PlausibilityMonitor::Wheels wheels,
                 const control::ChecksOff& off)
      : robot_(robot), monitor_(robot.joints(), wheels, off) {}

  std::span<const hal::JointInfo> joints() const noexcept override { return robot_.joints(); }
  void activate() override { robot_.activate(); }
  void deactivate() noexcept override { robot_.deactivate(); }
  hal::CycleStatus exchange(const hal::RobotCommand& command, hal::RobotSample& sample) noexcept override;
  std::vector<std::string> notes() const override { return robot_.notes(); }
  std::string explain(const hal::CycleStatus& status) const override { return robot_.explain(status); }
  std::optional<hal::BusLosses> losses() const override { return robot_.losses(); }
  std::vector<std::string> trouble() const override { return robot_.trouble(); }
  std::vector<std::string> report() const override { return robot_.report(); }

 private:
  hal::Robot& robot_;
  control::PlausibilityMonitor monitor_;
  std::chrono::nanoseconds stamp_{};
  hal::CycleStatus latched_{};
};

}  // namespace apps
