#include "control/base_rolling.h"

#include <Eigen/QR>
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <stdexcept>

#include "control/link_map.h"

namespace control {
namespace {

using Twist = Eigen::Matrix<double, 3, Eigen::Dynamic>;
using Rolling = Eigen::Matrix<double, Eigen::Dynamic, 3>;

void require_wheels(const BaseDescription& base, std::size_t wheels) {
  if (base.wheels.size() != wheels)
    throw std::invalid_argument("the base has " + std::to_string(wheels) + " wheels by its kinematics, not " +
                                std::to_string(base.wheels.size()));
}

/// Distances that the wheels of an omni base roll in a motion.
Rolling omni_rolling(const BaseDescription& base) {
  Rolling result(static_cast<Eigen::Index>(base.wheels.size()), 3);
  for (Eigen::Index i = 0; i < result.rows(); ++i) {
    const double angle = base.wheels[static_cast<std::size_t>(i)].angle_rad;
    result.row(i) << -std::sin(angle), std::cos(angle), base.turning_length_m;
  }
  return result;
}

}  // namespace

BaseRolling::BaseRolling(const BaseDescription& base) : base_(base) {
  const double length_m = base.turning_length_m;
  if (!std::isfinite(length_m) || !(length_m > 0))
    throw std::invalid_argument("the turning length of a base must be positive");
  switch (base.kinematics) {
    case BaseKinematics::kDifferential:
      require_wheels(base, 2);
      twist_.resize(3, 2);
      twist_ << 0.5, 0.5, 0, 0, -1 / length_m, 1 / length_m;
      rolling_.resize(2, 3);
      rolling_ << 1, 0, -length_m / 2, 1, 0, length_m / 2;
      break;
    case BaseKinematics::kTricycle: require_wheels(base, 1); break;
    case BaseKinematics::kOmni: {
      rolling_ = omni_rolling(base);
      const Eigen::ColPivHouseholderQR<Rolling> solver(rolling_);
      if (rolling_.rows() < 3 || solver.rank() < 3)
        throw std::invalid_argument("the wheels of an omni base do not determine its motion");
      twist_ = solver.solve(Eigen::MatrixXd::Identity(rolling_.rows(), rolling_.rows()));
      break;
    }
    case BaseKinematics::kMecanum: {
      require_wheels(base, 4);
      const LinkMap map =
          LinkMap::with_geometry({.wheel_radius_m = 1, .wheelbase_m = length_m, .track_m = length_m});
      twist_.resize(3, 4);
      rolling_.resize(4, 3);
      for (Eigen::Index i = 0; i < 4; ++i) twist_.col(i) = map.twist(WheelVector::Unit(i));
      for (Eigen::Index i = 0; i < 3; ++i) rolling_.col(i) = map.wheel_velocity(PlanarVector::Unit(i));
      break;
    }
  }
}

PlanarVector BaseRolling::displacement(const Wheels& wheels) const noexcept {
  const auto rolled_m = [&](std::size_t i) {
    const double lost = wheels.loaded_rad.empty() ? 0 : base_.slip_with_load * wheels.loaded_rad[i];
    return base_.wheels[i].radius_m * (wheels.angle_rad[i] - lost);
  };
  PlanarVector motion = PlanarVector::Zero();
  if (base_.kinematics == BaseKinematics::kTricycle) {
    const double steering = wheels.steering_rad + base_.steering_offset_rad;
    const double u_m = rolled_m(0);
    motion = {u_m * std::cos(steering), 0, u_m * std::sin(steering) / base_.turning_length_m};
  } else {
    for (std::size_t i = 0; i < base_.wheels.size(); ++i)
      motion += rolled_m(i) * twist_.col(static_cast<Eigen::Index>(i));
  }
  const double of_floor = wheels.floor < 0 ? 0 : base_.floors[static_cast<std::size_t>(wheels.floor)].slip;
  return {motion[0] * (1 - of_floor - base_.slip_forward), motion[1] * (1 - of_floor - base_.slip_sideways),
          motion[2] * (1 - of_floor)};
}

BaseRolling::Turned BaseRolling::wheels_for(const PlanarVector& displacement_B) const {
  Turned result;
  if (base_.kinematics == BaseKinematics::kTricycle) {
    const double across_m = displacement_B[2] * base_.turning_length_m;
    const double sign = displacement_B[0] < 0 ? -1 : 1;
    result.angle_rad = {sign * std::hypot(displacement_B[0], across_m) / base_.wheels[0].radius_m};
    result.steering_rad =
        std::atan2(sign * across_m, std::abs(displacement_B[0])) - base_.steering_offset_rad;
    return result;
  }
  const Eigen::VectorXd rolled_m = rolling_ * displacement_B;
  for (std::size_t i = 0; i < base_.wheels.size(); ++i)
    result.angle_rad.push_back(rolled_m[static_cast<Eigen::Index>(i)] / base_.wheels[i].radius_m);
  return result;
}

PlanarVector BaseRolling::tracked(const PlanarPose& X_B0B1) const noexcept {
  const BaseDescription::Tracking& tracking = base_.tracking;
  const PlanarVector offset(tracking.p_BT_m.x(), tracking.p_BT_m.y(), 0);
  const PlanarVector moved =
      PlanarVector(X_B0B1.x_m, X_B0B1.y_m, 0) + rotated(offset, X_B0B1.yaw_rad) - offset;
  PlanarVector result = tracking.scale * rotated(moved, -tracking.yaw_BT_rad);
  result[2] = X_B0B1.yaw_rad;
  return result;
}

}  // namespace control
