#include "identification/robot_gap/base_experiments.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdio>
#include <numbers>

#include "control/base_rolling.h"
#include "control/planar.h"
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

}  // namespace identification::robot_gap
