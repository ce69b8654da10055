/// @file
/// A robot: its joints, one exchange per cycle, and how to open one.
///
///     youbot::SteadyClock clock;
///     youbot::OpenedRobot opened = youbot::open_robot({.name = "loopback"}, clock, 1ms);
///     youbot::MonitoredRobot robot(*opened.robot, youbot::MonitoredRobot::Wheels::kRolling);
///     robot.activate();                                            // set-up: blocks, throws SetupError
///     command.enable = true;
///     while (...) {                                                // 1 kHz, one thread
///       clock.sleep_until(deadline += 1ms);
///       const youbot::CycleStatus status = robot.exchange(command, sample);   // noexcept, no allocation
///       if (!status.ok()) break;                                   // drives are off; robot.explain(status)
///     }
///     robot.deactivate();
///
/// MonitoredRobot judges the sensors in each cycle and stops the drives when one cannot be right. Without it,
/// use *opened.robot: limits then rely on sensors that nothing checks (docs/safety.md, "Sensors that lie").
///
/// SI units at the gearbox output: rad, rad/s, N·m. Joints in bus order: wheels 1 front-left, 2 front-right,
/// 3 rear-left, 4 rear-right, then the arm's joints from the base on. All wheels positive turn the base
/// counter-clockwise (hal/robot.h, hal/joint.h).
#pragma once
#include "hal/clock.h"
#include "hal/robot.h"
#include "hal/setup_error.h"
#include "runtime/monitored_robot.h"
#include "runtime/open_robot.h"
#include "runtime/real_time.h"

namespace youbot {

// One exchange per cycle.
using hal::CommandMode;
using hal::CycleStatus;
using hal::Fault;
using hal::GripperCommand;
using hal::GripperSample;
using hal::JointCommand;
using hal::JointFault;
using hal::JointInfo;
using hal::JointSample;
using hal::kMaxGrippers;
using hal::kMaxJoints;
using hal::Robot;
using hal::RobotCommand;
using hal::RobotSample;
using hal::SetupError;

// Time: the machine's clock, or virtual time for simulated robots.
using hal::Clock;
using hal::SteadyClock;
using hal::VirtualClock;

// Robots by name: loopback, wire, ethercat:IFACE, can:IFACE.
using hal::YoubotKind;
using runtime::is_simulated;
using runtime::open_robot;
using runtime::OpenedRobot;
using runtime::RobotOptions;

// Its sensors, judged in each cycle.
using runtime::MonitoredRobot;

// Real-time scheduling and locked memory for the thread that calls exchange().
using runtime::RealTimeConfig;
using runtime::RealTimeThread;

}  // namespace youbot
