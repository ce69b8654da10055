/// @file
/// Teleoperation of the simulated robot by a simulated hand, cycle by cycle in virtual time.
#pragma once
#include <chrono>
#include <functional>

#include "control/teleoperation.h"
#include "hal/clock.h"
#include "operation/teleop_task.h"
#include "runtime/open_haptic.h"
#include "runtime/open_robot.h"
#include "runtime/robot_session.h"

namespace youbot_bench::thesis {

/// One thread.
class TeleopRig {
 public:
  /// `on_ground` false: the wheels are lifted, the arm alone moves the end effector.
  TeleopRig(const control::Teleoperation::Config& config, bool on_ground);

  /// One cycle. @throws Stopped when the program is asked to end.
  const operation::TeleopRecord& step();
  /// False if the wanted phase was not reached within `limit`.
  bool run_until(control::TeleopPhase wanted, std::chrono::seconds limit,
                 const std::function<void(const operation::TeleopRecord&)>& each = {});
  control::TeleopPhase phase() const noexcept { return cycle_.task().phase(); }
  bool finished() const noexcept { return cycle_.finished(); }
  sim::Hand& hand() noexcept { return *master_.hand; }

 private:
  hal::VirtualClock clock_;
  runtime::OpenedRobot robot_;
  runtime::OpenedHaptic master_;
  operation::TeleopCycle cycle_;
  runtime::RobotActivation activation_;
  std::int64_t cycles_ = 0;
};

/// As in youbotd's teleop.toml: the base may pull and push.
control::Teleoperation::Config usual_teleoperation();

}  // namespace youbot_bench::thesis
