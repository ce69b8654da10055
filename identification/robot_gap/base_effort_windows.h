/// @file
/// Torques and motion of a base's wheels, averaged over short windows so that no signal is differentiated
/// twice.
#pragma once
#include <Eigen/Core>
#include <cstddef>
#include <span>
#include <vector>

#include "control/base_description.h"
#include "control/planar.h"
#include "identification/robot_gap/base_motion.h"

namespace identification::robot_gap {

/// Means over a window, weighted with sin². An acceleration is the mean of the speed with the derivative of
/// that weight (weak form: by parts), from differences of the recorded angles.
struct EffortWindow {
  std::size_t run = 0;  ///< of the motion's
  double start_s = 0;
  double end_s = 0;
  control::PlanarPose pose;     ///< of the tracked body, in the middle
  control::PlanarVector twist;  ///< mean, of the given description [m/s, m/s, rad/s]

  // Of each wheel.
  Eigen::VectorXd torque_Nm;
  Eigen::VectorXd speed_rad_per_s;
  Eigen::VectorXd acceleration_rad_per_s2;
  /// Less what the given slip by load loses: of what the base moves by.
  Eigen::VectorXd rolled_rad_per_s2;
  Eigen::VectorXd sign;            ///< of its speed; it does not change
  Eigen::MatrixXd speed_products;  ///< of what they roll, each with each [rad²/s²]

  double cos_yaw = 1;  ///< of the tracked body
  double sin_yaw = 0;
  double sideways_sign = 0;  ///< of the base's speed, smooth about zero
  double turning_sign = 0;

  /// Of a tricycle, means with cosine c and sine s of its steering angle and the speed ω of its wheel.
  struct Steered {
    double cc = 0;                                    ///< of c·d(c·ω)/dt
    double ss = 0;                                    ///< of s·d(s·ω)/dt
    double cs = 0;                                    ///< of c·d(s·ω)/dt
    double sc = 0;                                    ///< of s·d(c·ω)/dt
    double css = 0;                                   ///< of c·s²·ω²
    Eigen::Vector2d c_yaw = Eigen::Vector2d::Zero();  ///< of c times cosine and sine of the yaw
    Eigen::Vector2d s_yaw = Eigen::Vector2d::Zero();
    double s_turning_sign = 0;
  } steered;

  // Variances of the means from white noise of 1 in the samples.
  double of_torque_noise = 0;
  double of_motion_noise = 0;  ///< of the acceleration [1/s⁴ of angles, 1/s² of speeds]
};

/// Rows over which speeds are means where they distinguish motion from rest.
inline constexpr double kSmoothedRows = 3;

/// Speeds below which nothing is said about friction.
struct RestSpeeds {
  Eigen::VectorXd wheel_rad_per_s;
  /// Below which the sign of a direction is smoothed; infinite, which leaves no sign, if its motion is noise.
  control::PlanarVector twist;
  double smooth_s = 0;  ///< time of kSmoothedRows rows
};
RestSpeeds rest_speeds(std::span<const BaseMotion> motions, const control::BaseDescription& base,
                       double smooth_s);

/// Windows that overlap by half, in stretches in which every wheel turns and none changes its direction: at
/// rest friction is any torque up to its breakaway. `lag_s`: of the torques behind the motion.
std::vector<EffortWindow> effort_windows(const BaseMotion& motion, const control::BaseDescription& base,
                                         const RestSpeeds& rest, double window_s, double lag_s);

/// Mean torques of a window with another lag [N·m].
Eigen::VectorXd mean_torque(const BaseRun& run, double start_s, double end_s, double lag_s);

/// Standard deviations of white noise, rounding included, in the samples of each wheel: from what changes
/// from sample to sample while it turns.
struct EffortNoise {
  Eigen::VectorXd torque_Nm;
  Eigen::VectorXd motion;  ///< rad, or rad/s of a wheel whose speed is recorded
};
EffortNoise effort_noise(std::span<const BaseMotion> motions, const RestSpeeds& rest);

}  // namespace identification::robot_gap
