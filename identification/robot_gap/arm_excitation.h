/// @file
/// Computes motions of an arm from which it is best identified, or which best separate two models of it.
#pragma once
#include <Eigen/Core>
#include <cstdint>
#include <functional>
#include <vector>

#include "control/arm_description.h"
#include "identification/experiments/fourier_motion.h"

namespace identification::robot_gap {

struct ExcitationLimits {
  experiments::MotionLimits motion;
  Eigen::VectorXd torque_Nm;  ///< of each joint, weight and friction included
  /// Whether the arm is clear of the robot and the floor in this pose.
  std::function<bool(const Eigen::VectorXd& q_rad)> is_clear;
  Eigen::VectorXd ready_rad;  ///< from which the first motion is reached, and the last one left
};

struct ExcitationOptions {
  int motions = 4;
  double motion_s = 20;
  double period_s = 10;  ///< of the Fourier series, whose harmonics are so many:
  int harmonics = 5;
  double ramp_s = 2;  ///< from rest, and to it
  int tries = 250;    ///< of each motion; the second half improves the best
  std::uint64_t seed = 1;
};

struct ExcitationPlan {
  std::vector<experiments::FourierMotion> motions;
  std::vector<double> worth;  ///< of the first, of the first two, and so on
  int refused = 0;            ///< tries that were beyond a limit
};

/// The motions that determine all arm_parameters() best: each adds most to the logarithm of the determinant
/// of the information, in units of the parameters' deviations (D-optimal). Each joint's torque scatters in
/// proportion to its friction. Every motion keeps all limits, as does a straight line in joint space between
/// the ready pose and the centres of the motions, in their order. Deterministic for a seed.
/// @throws std::invalid_argument if no try keeps the limits.
ExcitationPlan plan_for_information(const control::ArmDescription& arm, const ExcitationLimits& limits,
                                    const ExcitationOptions& options);

/// The motions in which two models differ most, in squares of the torques' deviations, after the wrong one
/// has been fitted to the right one by the parameters in which it is not `given`; whichever is right.
/// [T-optimal: A. Atkinson, V. Fedorov, Biometrika 62, 1975] The torques of both models keep the limits.
/// @throws std::invalid_argument as above, or if the two do not differ.
ExcitationPlan plan_for_separation(const control::ArmDescription& given, const control::ArmDescription& one,
                                   const control::ArmDescription& other, const ExcitationLimits& limits,
                                   const ExcitationOptions& options);

}  // namespace identification::robot_gap
