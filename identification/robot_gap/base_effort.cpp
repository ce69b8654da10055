#include "identification/robot_gap/base_effort.h"

#include <Eigen/Geometry>
#include <Eigen/QR>
#include <algorithm>
#include <cmath>
#include <cstddef>

#include "control/base_rolling.h"
#include "model/gravity.h"

namespace identification::robot_gap {
namespace {

using control::BaseDescription;
using control::BaseKinematics;
using control::BaseRolling;
using control::PlanarVector;

/// Rise of the floor along the base's x and y; `yaw`: cosine and sine.
double uphill(const Eigen::Vector2d& yaw, const Eigen::Vector2d& slope) { return yaw.dot(slope); }
double across(const Eigen::Vector2d& yaw, const Eigen::Vector2d& slope) {
  return yaw.x() * slope.y() - yaw.y() * slope.x();
}

/// Reported torque of a mean wheel for each force or moment.
Eigen::Vector3d torques_of_forces(const BaseDescription& base) {
  double radius_m = 0;
  double scale = 0;
  for (const BaseDescription::Wheel& wheel : base.wheels) {
    radius_m += wheel.radius_m;
    scale += wheel.torque_scale;
  }
  return radius_m / scale * Eigen::Vector3d(1, 1, 1 / base.turning_length_m);
}

}  // namespace

std::vector<Eigen::Index> effort_axes(BaseKinematics kinematics) {
  switch (kinematics) {
    case BaseKinematics::kDifferential: return {0, 2};
    case BaseKinematics::kTricycle: return {0};
    case BaseKinematics::kOmni:
    case BaseKinematics::kMecanum: return {0, 1, 2};
  }
  return {};
}

BaseForces::BaseForces(const BaseDescription& base, const BaseDescription& given, int floor)
    : base_(base), reported_(torques_of_forces(base).cwiseQuotient(torques_of_forces(given))) {
  if (floor >= 0) {
    const BaseDescription::Floor& own = base.floors[static_cast<std::size_t>(floor)];
    floor_resistance_N_ = own.resistance_N;
    moved_turning_ -= own.slip;
  }
  moved_along_ = moved_turning_ - base.slip_forward;
  const auto wheels = static_cast<Eigen::Index>(base.wheels.size());
  scales_.resize(wheels);
  for (Eigen::Index w = 0; w < wheels; ++w)
    scales_[w] = base.wheels[static_cast<std::size_t>(w)].torque_scale;
  rates_ = Eigen::MatrixX3d::Zero(wheels, 3);
  twists_ = Eigen::Matrix3Xd::Zero(3, wheels);
  if (base.kinematics == BaseKinematics::kTricycle) {
    rates_(0, 0) = 1 / base.wheels[0].radius_m;
    return;
  }
  const BaseRolling rolling(base);
  for (const Eigen::Index axis : effort_axes(base.kinematics)) {
    const std::vector<double> turned = rolling.wheels_for(PlanarVector::Unit(axis)).angle_rad;
    rates_.col(axis) = Eigen::Map<const Eigen::VectorXd>(turned.data(), wheels);
  }
  for (Eigen::Index w = 0; w < wheels; ++w) {
    std::vector<double> unit(base.wheels.size(), 0);
    unit[static_cast<std::size_t>(w)] = 1;
    BaseRolling::Wheels one;
    one.angle_rad = unit;
    one.floor = floor;
    twists_.col(w) = rolling.displacement(one);
  }
}

Eigen::Vector3d BaseForces::pushed(const EffortWindow& window) const {
  return rates_.transpose() * scales_.cwiseProduct(window.torque_Nm);
}

/// To friction and inertia of the wheels.
Eigen::VectorXd BaseForces::lost_torque(const EffortWindow& window) const {
  Eigen::VectorXd lost(window.torque_Nm.size());
  for (Eigen::Index w = 0; w < lost.size(); ++w) {
    const BaseDescription::Wheel& wheel = base_.wheels[static_cast<std::size_t>(w)];
    const double friction_Nm =
        wheel.coulomb_Nm + floor_resistance_N_ * wheel.radius_m / static_cast<double>(lost.size());
    lost[w] = wheel.offset_Nm + friction_Nm * window.sign[w] +
              wheel.viscous_Nm_s_per_rad * window.speed_rad_per_s[w] +
              wheel.inertia_kg_m2 * window.acceleration_rad_per_s2[w];
  }
  return lost;
}

Eigen::VectorXd BaseForces::reported_torques(const EffortWindow& window) const {
  const Eigen::VectorXd pushing = rates_.transpose().completeOrthogonalDecomposition().solve(needed(window));
  return (pushing + lost_torque(window)).cwiseQuotient(scales_);
}

Eigen::Vector3d BaseForces::needed(const EffortWindow& window) const {
  if (base_.kinematics == BaseKinematics::kTricycle) return {needed_along(window), 0, 0};
  const BaseDescription::Body& body = base_.body;
  const Eigen::Vector3d change = twists_ * window.rolled_rad_per_s2;
  const Eigen::Matrix3d products = twists_ * window.speed_products * twists_.transpose();
  const double m = body.mass_kg;
  const double cx = body.p_BC_m.x();
  const double cy = body.p_BC_m.y();
  const Eigen::Vector2d yaw =
      Eigen::Rotation2Dd(-base_.tracking.yaw_BT_rad) * Eigen::Vector2d(window.cos_yaw, window.sin_yaw);
  const double forward = change[0] - products(1, 2) + model::kGravity_m_per_s2 * uphill(yaw, body.slope);
  const double sideways = change[1] + products(0, 2) + model::kGravity_m_per_s2 * across(yaw, body.slope);
  return {m * (forward - cy * change[2] - cx * products(2, 2)),
          m * (sideways + cx * change[2] - cy * products(2, 2)) +
              body.sideways_resistance_N * window.sideways_sign,
          (body.yaw_inertia_kg_m2 + m * body.p_BC_m.squaredNorm()) * change[2] +
              m * (cx * sideways - cy * forward) + body.turning_resistance_Nm * window.turning_sign};
}

/// Power of all forces over the speed of the steered wheel; its steering angle is the given one.
double BaseForces::needed_along(const EffortWindow& window) const {
  const BaseDescription::Body& body = base_.body;
  const EffortWindow::Steered& steered = window.steered;
  const double length_m = base_.turning_length_m;
  const double radius_m = base_.wheels[0].radius_m;
  const double cx = body.p_BC_m.x();
  const double cy = body.p_BC_m.y();
  const double inertia = body.yaw_inertia_kg_m2 + body.mass_kg * body.p_BC_m.squaredNorm();
  const Eigen::Rotation2Dd to_base(-base_.tracking.yaw_BT_rad);
  const Eigen::Vector2d c_yaw = to_base * steered.c_yaw;
  const Eigen::Vector2d s_yaw = to_base * steered.s_yaw;
  const double along = moved_along_ * radius_m;
  const double turned = moved_turning_ * radius_m / length_m;
  return body.mass_kg * along * steered.cc + inertia * turned / length_m * steered.ss -
         body.mass_kg * cy * (turned * steered.cs + along / length_m * steered.sc) +
         body.mass_kg * cx * turned * (along / length_m - turned) * steered.css +
         body.mass_kg * model::kGravity_m_per_s2 *
             (uphill(c_yaw, body.slope) +
              (cx * across(s_yaw, body.slope) - cy * uphill(s_yaw, body.slope)) / length_m) +
         body.turning_resistance_Nm / length_m * steered.s_turning_sign;
}

Eigen::Vector3d BaseForces::excess(const EffortWindow& window) const {
  return reported_.cwiseProduct(pushed(window) - rates_.transpose() * lost_torque(window) - needed(window));
}

Eigen::Vector3d effort_floor(const BaseDescription& base, std::span<const BaseMotion> motions,
                             std::span<const std::vector<EffortWindow>> windows, const EffortNoise& noise) {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  double count = 0;
  for (std::size_t m = 0; m < windows.size(); ++m) {
    const BaseForces forces(base, base, motions[m].floor);
    for (const EffortWindow& window : windows[m]) {
      const Eigen::Vector3d as_is = forces.excess(window);
      const auto add = [&](const EffortWindow& other) { sum += (forces.excess(other) - as_is).cwiseAbs2(); };
      for (Eigen::Index w = 0; w < noise.torque_Nm.size(); ++w) {
        EffortWindow other = window;
        other.torque_Nm[w] += std::sqrt(window.of_torque_noise) * noise.torque_Nm[w];
        add(other);
        other = window;
        const double more = std::sqrt(window.of_motion_noise) * noise.motion[w];
        other.acceleration_rad_per_s2[w] += more;
        other.rolled_rad_per_s2[w] += more;
        other.steered.cc += more;
        add(other);
      }
      ++count;
    }
  }
  return (sum / std::max(1.0, count)).cwiseSqrt();
}

}  // namespace identification::robot_gap
