/// @file
/// The simulated robot under the daemon's own cycles, with a sensor that can be faulty. In virtual time.
#pragma once
#include <Eigen/Geometry>
#include <chrono>
#include <memory>
#include <random>
#include <string>
#include <vector>

#include "hal/clock.h"
#include "operation/base_task.h"
#include "operation/teleop_task.h"
#include "operation/velocity_source.h"
#include "sim/base.h"
#include "tests/operation/teleop_rig.h"
#include "tests/support/held_up_robot.h"
#include "tests/support/lying_robot.h"
#include "tests/support/watched_robot.h"

namespace sensor_rigs {

using teleop_rig::kPeriod;

/// Like the daemon's loop: a late cycle keeps the phase.
template <typename Cycle>
void step_in_time(hal::VirtualClock& clock, std::chrono::nanoseconds& due, Cycle& cycle) {
  due += (clock.now() - due) / kPeriod * kPeriod + kPeriod;
  clock.sleep_until(due);
  cycle.step(clock.now());
}

/// The base under the daemon's cycle, driven at the velocity that motion.tell() gives.
struct BaseRig {
  explicit BaseRig(const sim::BaseParameters& parameters = {}, const control::ChecksOff& off = {})
      : base(parameters), cycle(config(off), liar, motion, nullptr) {
    robot.watch.allow_enables(1);
    robot.activate();
  }

  static std::vector<hal::JointInfo> wheels() {
    std::vector<hal::JointInfo> wheels;
    for (int i = 1; i <= 4; ++i) wheels.push_back({"wheel-" + std::to_string(i), 2.467, 16.2});
    return wheels;
  }
  static operation::Cycle::Config config(const control::ChecksOff& off = {}) {
    operation::Cycle::Config config;
    config.checks_off = off;
    config.controller.wrench_limits = {60.0, 20.0};
    return config;
  }
  bool over() const { return static_cast<bool>(cycle.stop_reason()); }
  void step() { step_in_time(clock, due, cycle); }
  void run(std::chrono::milliseconds duration) {
    for (auto left = duration; left > std::chrono::milliseconds{0} && !over(); left -= kPeriod) step();
  }

  hal::VirtualClock clock;
  std::chrono::nanoseconds due{};  // of the last cycle
  sim::Base base;
  support::WatchedLoopback robot{base, clock, kPeriod, wheels()};
  support::HeldUpRobot bus{robot, clock};
  support::LyingRobot liar{bus};
  operation::VelocitySource motion{control::BasePath::Limits{0.8, 0.5, 1.5, 1.5},
                                   {control::LinkMap::with_geometry({}), 1e3},
                                   kPeriod,
                                   {.m = 0.1, .rad = 0.2},
                                   control::Workspace{}.base_W_m};
  operation::Cycle cycle;
};

inline std::vector<hal::JointInfo> robot_joints() {
  std::vector<hal::JointInfo> joints = BaseRig::wheels();
  const double limits_Nm[] = {15.68, 15.68, 10.05, 10.86, 3.48};
  for (int i = 0; i < 5; ++i) joints.push_back({"arm-" + std::to_string(i + 1), limits_Nm[i], 1.57});
  return joints;
}

/// Base and arm in teleoperation, with a simulated hand on the handle.
struct ArmRig {
  explicit ArmRig(const teleop_rig::Scene& scene = teleop_rig::unfolded_scene(),
                  const control::ChecksOff& off = {})
      : plant(scene.robot, scene.environment), hand(scene.hand), cycle(config(off), liar, master) {
    robot.watch.allow_enables(1);
    robot.activate();
    master.activate();
  }
  static operation::TeleopCycle::Config config(const control::ChecksOff& off) {
    operation::TeleopCycle::Config config = teleop_rig::quick_config();
    config.checks_off = off;
    return config;
  }
  bool over() const { return cycle.task().end() != control::TeleopEnd::kNone; }
  void step() { step_in_time(clock, due, cycle); }
  void run(std::chrono::milliseconds duration) {
    for (auto left = duration; left > std::chrono::milliseconds{0} && !over(); left -= kPeriod) step();
  }
  bool reach(control::TeleopPhase phase) {
    for (int i = 0; i < 60'000 && !over() && cycle.task().phase() != phase; ++i) step();
    return cycle.task().phase() == phase;
  }
  /// The hand moves the end effector about for this time.
  void play(std::mt19937& random, std::chrono::milliseconds duration) {
    std::uniform_real_distribution<> both(-1, 1);
    constexpr std::chrono::milliseconds kMove{900};
    constexpr std::chrono::milliseconds kMoveAndRest{1200};
    for (auto left = duration; left > std::chrono::milliseconds{0} && !over(); left -= kMoveAndRest) {
      hand.move_to({0.04 * both(random), 0.04 * both(random), 0.04 * both(random)}, kMove);
      hand.turn_to(Eigen::Quaterniond(Eigen::AngleAxisd(0.3 * both(random), Eigen::Vector3d::UnitY())),
                   kMove);
      run(kMoveAndRest);
    }
  }

  hal::VirtualClock clock;
  std::chrono::nanoseconds due{};  // of the last cycle
  sim::MobileManipulator plant;
  sim::Hand hand;
  support::WatchedLoopback robot{plant, clock, kPeriod, robot_joints()};
  hal::LockstepHapticDevice master{
      std::make_unique<hal::LoopbackHapticLink>(
          hand, kPeriod, hal::HapticInfo{.name = "pen", .force_limit_N = 8.0, .senses_rotation = true}),
      clock,
      {}};
  support::HeldUpRobot bus{robot, clock};
  support::LyingRobot liar{bus};
  operation::TeleopCycle cycle;
};

}  // namespace sensor_rigs
