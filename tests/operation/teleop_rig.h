/// @file
/// Teleoperation in virtual time: the simulated robot and handle under the daemon's own cycle.
#pragma once
#include <Eigen/Geometry>
#include <chrono>
#include <functional>
#include <memory>
#include <optional>
#include <vector>

#include "hal/clock.h"
#include "hal/lockstep_haptic_device.h"
#include "hal/loopback_haptic_link.h"
#include "operation/teleop_task.h"
#include "sim/hand.h"
#include "sim/mobile_manipulator.h"
#include "tests/support/lossy_robot.h"
#include "tests/support/watched_robot.h"

namespace teleop_rig {

using operation::TeleopCycle;
using operation::TeleopRecord;

inline constexpr std::chrono::milliseconds kPeriod{1};

inline std::vector<hal::JointInfo> joints() {
  std::vector<hal::JointInfo> joints;
  for (int i = 1; i <= 4; ++i) joints.push_back({"wheel-" + std::to_string(i), 2.5});
  for (int i = 1; i <= 5; ++i) joints.push_back({"arm-" + std::to_string(i), 15.0, 1.57});
  return joints;
}

/// The base may pull and push as in teleop.toml.
inline TeleopCycle::Config config() {
  TeleopCycle::Config config;
  config.control.robot.base.wrench_limits = {60, 20};
  return config;
}

/// Like config(), with a quick start-up: the arm begins nearly unfolded and becomes stiff at once.
inline TeleopCycle::Config quick_config() {
  TeleopCycle::Config quick = config();
  quick.control.approach_s = 4.0;
  quick.control.stiffening_per_s = {6000, 300};
  quick.control.feedback_fade_s = 0.2;
  return quick;
}

struct Scene {
  sim::MobileManipulatorParameters robot;
  sim::EnvironmentParameters environment;
  sim::HandParameters hand{.travel = sim::GripTravel{}};
};

inline Scene unfolded_scene() {
  Scene scene;
  scene.robot.start_rad << 2.9, 1.1, -2.5, 1.75, 2.9;
  return scene;
}

class Rig {
 public:
  explicit Rig(const TeleopCycle::Config& config = quick_config(), const Scene& scene = unfolded_scene(),
               const hal::HapticLimits& limits = {})
      : plant(scene.robot, scene.environment),
        hand(scene.hand),
        robot(plant, clock, kPeriod, joints()),
        master(
            std::make_unique<hal::LoopbackHapticLink>(
                hand, kPeriod, hal::HapticInfo{.name = "pen", .force_limit_N = 8.0, .senses_rotation = true}),
            clock, limits),
        bus(robot),
        cycle(config, bus, master) {
    robot.watch.allow_enables(1);
    robot.activate();
    master.activate();
  }

  /// One cycle.
  void step() {
    clock.sleep_until(clock.now() + kPeriod);
    cycle.step(clock.now());
    operation::add_truth(cycle.record(), plant.X_WT().translation(), plant.contact_force_W_N());
    records.push_back(cycle.record());
  }
  void run(std::chrono::nanoseconds duration) {
    for (std::chrono::nanoseconds t{}; t < duration; t += kPeriod) step();
  }
  /// False if it was not reached within `limit`.
  bool run_until(control::TeleopPhase phase, std::chrono::nanoseconds limit = std::chrono::seconds(90)) {
    for (std::chrono::nanoseconds t{}; t < limit; t += kPeriod) {
      step();
      if (cycle.task().phase() == phase) return true;
    }
    return false;
  }
  const TeleopRecord& last() const { return records.back(); }

  hal::VirtualClock clock;
  sim::MobileManipulator plant;
  sim::Hand hand;
  support::WatchedLoopback robot;
  hal::LockstepHapticDevice master;
  support::LossyRobot bus;
  TeleopCycle cycle;
  std::vector<TeleopRecord> records;
};

}  // namespace teleop_rig
