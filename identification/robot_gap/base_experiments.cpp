#include "identification/robot_gap/base_experiments.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdio>
#include <numbers>

#include "control/base_rolling.h"
#include "control/planar.h"
#include "identification/robot_gap/base_effort.h"
#include "identification/robot_gap/base_motion.h"

namespace identification::robot_gap {
namespace {

using control::BaseDescription;
using control::BaseKinematics;
using control::BaseRolling;
using control::PlanarVector;

/// Differences below this share of the noise floors are no difference.
constexpr double kVisible = 0.1;
constexpr int kStepsOfMotion = 16;
/// Radius of a circle in turning lengths.
constexpr double kCircle = 4;

/// One after the other, each over a window.
struct TriedMotion {
  std::string name;
  std::vector<PlanarVector> displacements;
};

std::vector<TriedMotion> motions_of(const SeenMotion& seen) {
  const double way_m = seen.speed_m_per_s * seen.window_s;
  const double circle_rad = way_m / (kCircle * seen.given.turning_length_m);
  const double turn_rad = std::max(seen.turn_rad_per_s * seen.window_s, circle_rad);
  std::vector<TriedMotion> motions{{"straight forward", {{way_m, 0, 0}}}};
  const bool sideways =
      seen.given.kinematics == BaseKinematics::kOmni || seen.given.kinematics == BaseKinematics::kMecanum;
  if (sideways) motions.push_back({"straight sideways", {{0, way_m, 0}}});
  if (seen.given.kinematics != BaseKinematics::kTricycle) {
    motions.push_back({"turning on the spot", {{0, 0, turn_rad}}});
    motions.push_back({"a square to the left", {{way_m, 0, 0}, {0, 0, turn_rad}}});
    motions.push_back({"a square to the right", {{way_m, 0, 0}, {0, 0, -turn_rad}}});
  }
  motions.push_back({"a circle to the left", {{way_m, 0, circle_rad}}});
  motions.push_back({"a circle to the right", {{way_m, 0, -circle_rad}}});
  return motions;
}

/// The wheels that make it by the given description.
WheelSteps steps_of(const BaseRolling& given, const PlanarVector& displacement,
                    const std::vector<double>& load) {
  const BaseRolling::Turned turned = given.wheels_for(displacement / kStepsOfMotion);
  const auto wheels = static_cast<Eigen::Index>(turned.angle_rad.size());
  WheelSteps steps;
  steps.angle_rad.resize(wheels, kStepsOfMotion);
  if (!load.empty()) steps.loaded_rad.resize(wheels, kStepsOfMotion);
  steps.steering_rad = Eigen::VectorXd::Constant(kStepsOfMotion, turned.steering_rad);
  for (Eigen::Index w = 0; w < wheels; ++w) {
    const auto at = static_cast<std::size_t>(w);
    steps.angle_rad.row(w).setConstant(turned.angle_rad[at]);
    if (!load.empty()) steps.loaded_rad.row(w).setConstant(turned.angle_rad[at] * load[at]);
  }
  return steps;
}

/// A steady twist that changes at a rate, by the given base without slip by load.
EffortWindow window_of(const BaseDescription& given, const PlanarVector& twist, const PlanarVector& change,
                       double yaw_rad) {
  const BaseRolling rolling(given);
  const auto wheels = [&](const PlanarVector& motion) {
    const std::vector<double> rates = rolling.wheels_for(motion).angle_rad;
    return Eigen::VectorXd(
        Eigen::Map<const Eigen::VectorXd>(rates.data(), static_cast<Eigen::Index>(rates.size())));
  };
  EffortWindow window;
  window.speed_rad_per_s = wheels(twist);
  window.acceleration_rad_per_s2 = wheels(change);
  window.rolled_rad_per_s2 = window.acceleration_rad_per_s2;
  window.sign = window.speed_rad_per_s.cwiseSign();
  window.speed_products = window.speed_rad_per_s * window.speed_rad_per_s.transpose();
  window.cos_yaw = std::cos(yaw_rad);
  window.sin_yaw = std::sin(yaw_rad);
  window.sideways_sign = (0 < twist[1]) - (twist[1] < 0);
  window.turning_sign = (0 < twist[2]) - (twist[2] < 0);
  if (given.kinematics == BaseKinematics::kTricycle) {
    const double steering = rolling.wheels_for(twist).steering_rad + given.steering_offset_rad;
    const double c = std::cos(steering);
    const double s = std::sin(steering);
    const double speed = window.speed_rad_per_s[0];
    const double rate = window.acceleration_rad_per_s2[0];
    const Eigen::Vector2d yaw(window.cos_yaw, window.sin_yaw);
    window.steered = {.cc = c * c * rate,
                      .ss = s * s * rate,
                      .cs = c * s * rate,
                      .sc = c * s * rate,
                      .css = c * s * s * speed * speed,
                      .c_yaw = c * yaw,
                      .s_yaw = s * yaw,
                      .s_turning_sign = s * window.turning_sign};
  }
  window.torque_Nm = Eigen::VectorXd::Zero(window.sign.size());
  return window;
}

/// Of the excess on a floor, in a motion for which the given base has the torques.
Eigen::Vector3d difference_of_forces(const BaseDescription& one, const BaseDescription& other,
                                     const BaseDescription& given, EffortWindow window, int floor) {
  window.torque_Nm = BaseForces(given, given, floor).reported_torques(window);
  return BaseForces(one, given, floor).excess(window) - BaseForces(other, given, floor).excess(window);
}

bool is_possible(BaseKinematics kinematics, const PlanarVector& twist) {
  if (kinematics == BaseKinematics::kTricycle) return twist[0] != 0 && twist[1] == 0;
  return twist[1] == 0 || kinematics == BaseKinematics::kOmni || kinematics == BaseKinematics::kMecanum;
}

}  // namespace

std::string deciding_motion(const BaseDescription& one, const BaseDescription& other,
                            const SeenMotion& seen) {
  const BaseRolling given(seen.given);
  const BaseRolling by_one(one);
  const BaseRolling by_other(other);
  constexpr const char* kChannels[] = {"forward", "sideways", "the heading"};
  double most = 0;
  Eigen::Index channel = 0;
  std::string name;
  std::vector<double> heavy = seen.load;
  for (double& load : heavy) load *= 2;
  for (const TriedMotion& motion : motions_of(seen))
    for (int floor = -1; floor < static_cast<int>(seen.given.floors.size()); ++floor) {
      if (floor < 0 && !seen.given.floors.empty()) continue;
      for (const bool is_heavy : {false, true}) {
        if (is_heavy && seen.load.empty()) continue;
        Eigen::Vector3d squares = Eigen::Vector3d::Zero();
        for (const PlanarVector& displacement : motion.displacements) {
          const WheelSteps steps = steps_of(given, displacement, is_heavy ? heavy : seen.load);
          squares += (predicted(by_one, steps, floor) - predicted(by_other, steps, floor)).cwiseAbs2();
        }
        const Eigen::Vector3d floors = (squares / static_cast<double>(motion.displacements.size()))
                                           .cwiseSqrt()
                                           .cwiseQuotient(seen.noise_floor);
        Eigen::Index where = 0;
        const double difference = floors.maxCoeff(&where);
        // Simple motions come first: others must show clearly more.
        if (difference <= 1.1 * most) continue;
        most = difference;
        channel = where;
        name = motion.name;
        if (floor >= 0) name += " on " + seen.given.floors[static_cast<std::size_t>(floor)].name;
        if (is_heavy) name += " with twice the load";
      }
    }
  char text[300];
  if (most < kVisible) {
    std::snprintf(text, sizeof text,
                  "none: straight on, turns, squares and circles at %.2g m/s all look alike to within %.2g "
                  "noise floors; measure one of the two by itself",
                  seen.speed_m_per_s, std::max(most, 0.01));
  } else {
    std::snprintf(text, sizeof text,
                  "%s at %.2g m/s: in windows of %.2g s they differ by %.2g noise floors in %s", name.c_str(),
                  seen.speed_m_per_s, seen.window_s, most, kChannels[static_cast<std::size_t>(channel)]);
  }
  return text;
}

std::string deciding_force(const BaseDescription& one, const BaseDescription& other, const SeenMotion& seen,
                           const Eigen::Vector3d& force_floor) {
  const std::vector<Eigen::Index> axes = effort_axes(seen.given.kinematics);
  const double speed = seen.speed_m_per_s;
  const double turn_rad_per_s = std::max(seen.turn_rad_per_s, speed / seen.given.turning_length_m / kCircle);
  struct TriedState {
    const char* name;
    PlanarVector twist;
    PlanarVector change;
  };
  // Speeding up: to the speed within half a second.
  const std::vector<TriedState> states{
      {"steadily forward", {speed, 0, 0}, {0, 0, 0}},
      {"steadily backward", {-speed, 0, 0}, {0, 0, 0}},
      {"steadily sideways", {0, speed, 0}, {0, 0, 0}},
      {"turning steadily on the spot", {0, 0, turn_rad_per_s}, {0, 0, 0}},
      {"on a circle", {speed, 0, turn_rad_per_s}, {0, 0, 0}},
      {"speeding up forward", {speed, 0, 0}, {2 * speed, 0, 0}},
      {"speeding up on a circle", {speed, 0, turn_rad_per_s}, {2 * speed, 0, 2 * turn_rad_per_s}},
      {"speeding up sideways", {0, speed, 0}, {0, 2 * speed, 0}},
      {"speeding up on the spot", {0, 0, turn_rad_per_s}, {0, 0, 2 * turn_rad_per_s}}};
  double most = 0;
  std::string name;
  for (const TriedState& state : states) {
    if (!is_possible(seen.given.kinematics, state.twist)) continue;
    for (int floor = seen.given.floors.empty() ? -1 : 0; floor < static_cast<int>(seen.given.floors.size());
         ++floor)
      for (const double yaw_rad : {0.0, std::numbers::pi / 2}) {
        const EffortWindow window = window_of(seen.given, state.twist, state.change, yaw_rad);
        const Eigen::Vector3d difference = difference_of_forces(one, other, seen.given, window, floor)
                                               .cwiseQuotient(force_floor.cwiseMax(1e-12));
        double own = 0;
        for (const Eigen::Index axis : axes) own = std::max(own, std::abs(difference[axis]));
        if (own <= 1.1 * most) continue;
        most = own;
        name = state.name;
        if (floor >= 0) name += " on " + seen.given.floors[static_cast<std::size_t>(floor)].name;
        if (yaw_rad > 0) name += ", with the heading at 90°";
      }
  }
  char text[300];
  if (most < kVisible)
    std::snprintf(
        text, sizeof text,
        "none: at the speeds of the recordings the forces differ by %.2g noise floors at most; measure "
        "one of the two by itself",
        most);
  else
    std::snprintf(text, sizeof text,
                  "%s at the speed of the recordings: the forces differ by %.2g noise floors", name.c_str(),
                  most);
  return text;
}

}  // namespace identification::robot_gap
