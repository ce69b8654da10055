/// @file
/// How uncertain the odometry of the base is (control/base_odometry.h).
#pragma once
#include <Eigen/Core>
#include <array>

#include "control/link_map.h"
#include "control/planar.h"

namespace control {

/// The way of wheel i over the floor differs from what its turning shows by
///   (share + slip/|way_i|) · way_i · e_i,
/// with e_i of variance 1, the same over `correlation_m` and another one beyond it (first-order
/// Gauss-Markov). The share stands for rollers, radius, load and floor. Slip shows where the wheels turn
/// against each other: four wheels have three freedoms, and n·Δw, with n the null space of the link map, is
/// in none of them. As much slip is assumed in those three, where it does not show.
///
/// One thread. Cycle: all but construction.
class OdometryCovariance {
 public:
  struct Config {
    double share = 0.01;         ///< standard deviation of the error over the way; assumption
    double correlation_m = 0.5;  ///< assumption
    /// To and fro up to here is no way, and wheels that turn against each other up to here do not slip: gears
    /// and rollers give way, encoders count.
    double give_m = 0.5e-3;
    double rest_m_per_s = 1e-3;  ///< standard deviation of a wheel's speed at rest, from its encoder
  };

  /// @throws std::invalid_argument for a length that is not finite and positive.
  explicit OdometryCovariance(const BaseGeometry& geometry) : OdometryCovariance(geometry, Config{}) {}
  OdometryCovariance(const BaseGeometry& geometry, const Config& config);

  /// The pose is known exactly. The first step after a reset only stores the wheel positions.
  void reset() noexcept;
  /// `X_WB`: pose by odometry after this step. Any rate, as long as the heading changes little in a step.
  /// A step with a value that is not finite is ignored.
  void step(const WheelVector& wheel_position_rad, const PlanarPose& X_WB) noexcept;

  /// Of the pose: x, y, yaw in W [m, m, rad].
  Eigen::Matrix3d pose_W() const noexcept { return state_.topLeftCorner<3, 3>(); }
  /// Of the mean twist over the last step, in B [m/s, m/s, rad/s]. `elapsed_s`: its length.
  Eigen::Matrix3d twist_B(double elapsed_s) const noexcept;
  /// Way that each wheel slipped since reset(), as far as it shows [m].
  double slipped_m() const noexcept { return slipped_m_; }

 private:
  /// Follows a value at a distance, as a nut with play does.
  struct Play {
    double centre_m = 0;
    double follow(double value_m, double give_m) noexcept;  ///< how it moved
  };

  Config config_;
  double radius_m_;
  Eigen::Matrix<double, 3, 4> map_;  // from the ways of the wheels [m] to a displacement
  bool started_ = false;
  WheelVector start_rad_ = WheelVector::Zero();
  PlanarPose X_WB_;
  WheelVector error_m_ = WheelVector::Zero();  // of each wheel's way in the last step, for e = 1
  std::array<Play, 4> wheels_{};
  Play against_;  // what the wheels turned against each other
  double slipped_m_ = 0;
  Eigen::Matrix<double, 7, 7> state_;  // covariance of pose and e
};

}  // namespace control
