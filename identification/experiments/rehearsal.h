/// @file
/// What an experiment will ask of a joint that has end stops, found by running it on none.
#pragma once
#include <algorithm>

#include "identification/experiments/joint_experiment.h"

namespace identification::experiments {

/// Velocity commands of such a joint change no faster, so that neither starting nor stopping takes much
/// torque: links and rotors of an arm together are below 2 kg·m² at any of its joints. The drives' own ramp
/// is faster (2000 rpm/s of the motor: 1.3 rad/s² of the joint with the highest gear).
inline constexpr double kGentle_rad_per_s2 = 1.0;

/// The velocity to command a period after `last`. Cycle.
constexpr double gently(double last_rad_per_s, double wanted_rad_per_s, double period_s) noexcept {
  const double change = kGentle_rad_per_s2 * period_s;
  return std::clamp(wanted_rad_per_s, last_rad_per_s - change, last_rad_per_s + change);
}

/// How far it goes on when it is to stop: 30 ms of filter and drive, and then that ramp. Cycle.
constexpr double stopping_distance_rad(double speed_rad_per_s) noexcept {
  return 0.03 * speed_rad_per_s + speed_rad_per_s * speed_rad_per_s / (2 * kGentle_rad_per_s2);
}

/// The most of all measurements. SI, joint side; positions count from where the joint is at the start.
struct Demand {
  double lowest_rad = 0.0;  ///< where velocity commands take it and it could stop if it had to
  double highest_rad = 0.0;
  double speed_rad_per_s = 0.0;  ///< largest velocity command
  double torque_Nm = 0.0;        ///< largest torque command
  /// Some commands are torques, zero while it rests: how far they move the joint is not known beforehand.
  bool by_torque = false;
};

/// Setup: the set-points that a robot would get, from `first_measurement` on. The joint follows velocity
/// commands exactly, gently, and stands still against torque, which is when an experiment pushes hardest.
/// `experiment` is as after a run.
Demand rehearse(JointExperiment& experiment, int first_measurement, double period_s);

}  // namespace identification::experiments
