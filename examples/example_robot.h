/// @file
/// Common part of the examples: the robot from the command line, and its clock.
#pragma once
#include <youbot/robot.h>

#include <chrono>
#include <csignal>
#include <cstdio>
#include <memory>
#include <optional>
#include <string>

/// Ctrl-C ends the cycles, so that the drives are switched off: a module on CAN keeps its last target
/// otherwise.
inline volatile std::sig_atomic_t stop_requested = 0;

/// A simulated robot runs in virtual time, as fast as the machine allows; any other in real time.
class ExampleRobot {
 public:
  static constexpr std::chrono::milliseconds kPeriod{1};

  /// "loopback" (the default), "wire", "ethercat:IFACE": a base. `on_ground`: whether its wheels carry it; a
  /// simulated one is put there.
  explicit ExampleRobot(const std::string& name, bool on_ground = true) {
    if (youbot::is_simulated(name))
      clock_ = std::make_unique<youbot::VirtualClock>();
    else
      clock_ = std::make_unique<youbot::SteadyClock>();
    youbot::RobotOptions options;
    options.name = name;
    options.simulation.on_ground = on_ground;
    opened_ = youbot::open_robot(options, *clock_, kPeriod);
    using Wheels = youbot::MonitoredRobot::Wheels;
    robot_.emplace(*opened_.robot, on_ground ? Wheels::kRolling : Wheels::kFree);
    robot().activate();
    deadline_ = clock_->now();
    for (const int signal : {SIGINT, SIGTERM}) std::signal(signal, [](int) { stop_requested = 1; });
  }
  ~ExampleRobot() { robot().deactivate(); }

  youbot::Robot& robot() { return *robot_; }

  /// Sleeps until the next period, then exchanges. False after Ctrl-C and after a fault, which it prints.
  bool cycle(const youbot::RobotCommand& command, youbot::RobotSample& sample) {
    if (stop_requested) return false;
    clock_->sleep_until(deadline_ += kPeriod);
    const youbot::CycleStatus status = robot().exchange(command, sample);
    if (!status.ok()) std::fprintf(stderr, "%s\n", robot().explain(status).c_str());
    return status.ok();
  }

  /// Enables the drives and waits until they obey, which may take seconds on a robot.
  bool enable(youbot::RobotCommand& command, youbot::RobotSample& sample) {
    command.enable = true;
    for (int n = 0; n < 30'000; ++n) {
      if (!cycle(command, sample)) return false;
      if (sample.enabled) return true;
    }
    std::fprintf(stderr, "the drives do not obey: check the emergency stop and the 24 V\n");
    return false;
  }

 private:
  std::unique_ptr<youbot::Clock> clock_;
  youbot::OpenedRobot opened_;
  std::optional<youbot::MonitoredRobot> robot_;  // judges the sensors of the opened one
  std::chrono::nanoseconds deadline_{};
};
