/// @file
/// Predicts what an experiment will command to a joint with end stops, by running it without a robot.
#pragma once
#include <algorithm>

#include "identification/experiments/joint_experiment.h"

namespace identification::experiments {

/// Limit on velocity changes for such a joint, so that neither start nor stop needs much torque: links and
/// rotors of an arm together are below 2 kg·m² at any of its joints. The drives' own ramp is faster (2000
/// rpm/s of the motor: 1.3 rad/s² of the joint with the highest gear ratio).
inline constexpr double kGentle_rad_per_s2 = 1.0;

/// The velocity to command one period after `last`. Cycle.
constexpr double gently(double last_rad_per_s, double wanted_rad_per_s, double period_s) noexcept {
  const double change = kGentle_rad_per_s2 * period_s;
  return std::clamp(wanted_rad_per_s, last_rad_per_s - change, last_rad_per_s + change);
}

/// Stopping distance: 30 ms of filter and drive, then that ramp. Cycle.
constexpr double stopping_distance_rad(double speed_rad_per_s) noexcept {
  return 0.03 * speed_rad_per_s + speed_rad_per_s * speed_rad_per_s / (2 * kGentle_rad_per_s2);
}

/// Maximum over all measurements. SI, joint side; positions are relative to the joint's start.
struct Demand {
  double lowest_rad = 0.0;  ///< reached by velocity commands, stopping distance included
  double highest_rad = 0.0;
  double speed_rad_per_s = 0.0;  ///< largest velocity command
  double torque_Nm = 0.0;        ///< largest torque command
  /// Some commands are torques, zero at rest: the resulting motion is not known in advance.
  bool by_torque = false;
};

/// Setup: the set-points that a robot would get, from `first_measurement` on. The joint follows velocity
/// commands exactly, with gentle changes, and does not move under torque, in which case an experiment pushes
/// hardest. `experiment` is as after a run.
Demand rehearse(JointExperiment& experiment, int first_measurement, double period_s);

}  // namespace identification::experiments
