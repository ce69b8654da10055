/// @file
/// The displacement that no model of a base predicts.
#pragma once
#include <Eigen/Core>
#include <span>
#include <vector>

#include "control/base_description.h"
#include "identification/robot_gap/base_motion.h"

namespace identification::robot_gap {

/// Variances of measured minus predicted displacement, of forward, sideways and heading [m², m², rad²], from
/// sensors and from slip that comes and goes.
struct BaseNoise {
  /// Of poses and encoder steps, at both ends of a window, however long.
  Eigen::Vector3d of_ends = Eigen::Vector3d::Zero();
  /// Of what adds up on the way, for each second.
  Eigen::Vector3d per_s = Eigen::Vector3d::Zero();
  /// Of wheel speeds that are rounded equally all through a window: times its length squared, [1/s²].
  Eigen::Vector3d of_speed_steps_per_s2 = Eigen::Vector3d::Zero();
};

/// `part_s`: length of the short windows from which it is estimated: an eighth of those to be compared.
/// `recordings`: for the quanta of the signals.
BaseNoise noise_of(const control::BaseDescription& base, std::span<const BaseRecording> recordings,
                   std::span<const BaseMotion> motions, double part_s);

/// What no 3×3 matrix explains of measured displacements, by predicted ones; one window in each row.
struct BaseScatter {
  Eigen::Vector3d rms = Eigen::Vector3d::Zero();  ///< without the outliers
  /// Windows in which the pose departs from the wheels far more than in the others, as if the base was pushed
  /// or a wheel spun. None if they are too many to be exceptions.
  std::vector<bool> is_outlier;
};
BaseScatter scatter_of(const Eigen::MatrixX3d& measured, const Eigen::MatrixX3d& predicted, double lever_m);

/// Rms residual of each channel that the noise leaves in windows of this length, with squares of the travel
/// forward and sideways as their means: an error of the heading turns them.
Eigen::Vector3d floor_of(const BaseNoise& noise, double window_s, const Eigen::Vector2d& travel_m2);

}  // namespace identification::robot_gap
