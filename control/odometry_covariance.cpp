#include "control/odometry_covariance.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "control/positive.h"

namespace control {
namespace {

/// No motion of the base turns the wheels like this, whatever the geometry.
const WheelVector kNullSpace{1, -1, -1, 1};

}  // namespace

OdometryCovariance::OdometryCovariance(const BaseGeometry& geometry, const Config& config)
    : config_(config), radius_m_(geometry.wheel_radius_m) {
  constexpr RequirePositive kRequire{"odometry covariance"};
  kRequire(config.share, "share");
  kRequire(config.correlation_m, "correlation_m");
  kRequire(config.give_m, "give_m");
  kRequire(config.rest_m_per_s, "rest_m_per_s");
  const LinkMap map = LinkMap::with_geometry(geometry);
  for (Eigen::Index i = 0; i < 4; ++i) map_.col(i) = map.twist(WheelVector::Unit(i)) / radius_m_;
  reset();
}

void OdometryCovariance::reset() noexcept {
  started_ = false;
  slipped_m_ = 0;
  error_m_.setZero();
  state_.setZero();
  state_.bottomRightCorner<4, 4>().setIdentity();
}

void OdometryCovariance::step(const WheelVector& wheel_position_rad, const PlanarPose& X_WB) noexcept {
  // Not known: a covariance that is not a number would stay one.
  if (!(wheel_position_rad.allFinite() && std::isfinite(X_WB.x_m + X_WB.y_m + X_WB.yaw_rad))) return;
  const Eigen::Vector2d moved_m(X_WB.x_m - X_WB_.x_m, X_WB.y_m - X_WB_.y_m);
  const double heading_rad = (X_WB.yaw_rad + X_WB_.yaw_rad) / 2;
  X_WB_ = X_WB;
  if (!started_) {
    started_ = true;
    start_rad_ = wheel_position_rad;
    wheels_ = {};
    against_ = {};
    return;
  }
  const WheelVector turned_m = radius_m_ * (wheel_position_rad - start_rad_);
  WheelVector way_m;
  for (Eigen::Index i = 0; i < 4; ++i)
    way_m[i] = wheels_[static_cast<std::size_t>(i)].follow(turned_m[i], config_.give_m);
  // Slips of the same size in all four wheels, independent, show as twice that size.
  const double slip_m = std::abs(against_.follow(kNullSpace.dot(turned_m), config_.give_m)) / 2;
  slipped_m_ += slip_m;
  // A wheel slips in the direction in which it turns.
  for (Eigen::Index i = 0; i < 4; ++i)
    error_m_[i] = config_.share * way_m[i] + std::copysign(slip_m, way_m[i]);

  Eigen::Matrix<double, 7, 7> carried = Eigen::Matrix<double, 7, 7>::Identity();
  // An error of the heading before this step turns the way of this step.
  carried(0, 2) = -moved_m.y();
  carried(1, 2) = moved_m.x();
  Eigen::Matrix3d R_WB = Eigen::Matrix3d::Identity();
  R_WB.topLeftCorner<2, 2>() = Eigen::Rotation2Dd(heading_rad).toRotationMatrix();
  carried.topRightCorner<3, 4>() = R_WB * map_ * error_m_.asDiagonal();
  const double kept = std::exp(-way_m.cwiseAbs().maxCoeff() / config_.correlation_m);
  carried.bottomRightCorner<4, 4>() *= kept;
  state_ = carried * state_.eval() * carried.transpose();
  state_.diagonal().tail<4>().array() += 1 - kept * kept;
}

Eigen::Matrix3d OdometryCovariance::twist_B(double elapsed_s) const noexcept {
  const WheelVector speed_m_per_s = (error_m_ / elapsed_s).cwiseAbs().array() + config_.rest_m_per_s;
  return map_ * speed_m_per_s.cwiseAbs2().asDiagonal() * map_.transpose();
}

double OdometryCovariance::Play::follow(double value_m, double give_m) noexcept {
  const double before_m = centre_m;
  centre_m = std::clamp(centre_m, value_m - give_m, value_m + give_m);
  return centre_m - before_m;
}

}  // namespace control
