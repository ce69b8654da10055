/// @file
/// The physical parameters of an arm that may be wrong, and the effects that they form.
#pragma once
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "control/arm_description.h"
#include "identification/robot_gap/subject.h"

namespace identification::robot_gap {

/// One parameter: torques change with it nearly in proportion.
struct ArmTerm {
  enum class Kind : std::uint8_t {
    kPayloadMass,    ///< [kg], at constant first moment
    kPayloadMoment,  ///< mass times distance from the tip [kg·m], along x, y or z of T
    kLinkMass,       ///< [kg], at the centre of mass; the rotational inertia about it stays
    kLinkDensity,    ///< [kg]; the rotational inertia grows with it
    kLinkCentre,     ///< [m] in L
    kLinkInertia,    ///< [kg·m²] about the centre, in L
    kTilt,           ///< of gravity, about an axis of B [rad]
    kEncoderZero,    ///< [rad]
    kCompliance,     ///< [rad/(N·m)]; `index` 1: friction acts before the gear
    kTorqueScale,
    kRotorInertia,
    kCoulomb,
    kViscous,
    kQuadraticDrag,
    kOffset,
    kLoadFriction,
    kStribeck,      ///< `setting`: Stribeck speed [rad/s]
    kSpring,        ///< about the drive's spring_rest_rad
    kCable,         ///< `index` 2 or 3: power of the angle
    kRippleSine,    ///< `setting`: periods in a turn of the joint
    kRippleCosine,  ///< likewise
    kNeighbour,     ///< `index` −1: friction with the direction of the joint before, 1: after
    kLag,           ///< of the recorded torque [s]; no part of the model
  };
  Kind kind{};
  int part = 0;  ///< joint and the link that it moves, from 0
  int index = 0;
  double setting = 0;
  bool operator==(const ArmTerm&) const = default;
};

/// What the description holds. A lag has none.
double value_of(const ArmTerm& term, const control::ArmDescription& arm);
/// Adds to the value.
void change(control::ArmDescription& arm, const ArmTerm& term, double by);
/// Two unit axes of B about which gravity can tilt.
struct TiltAxes {
  Eigen::Vector3d first;
  Eigen::Vector3d second;
};
TiltAxes tilt_axes(const Eigen::Vector3d& gravity_B);

struct ArmCatalogue {
  std::vector<ArmTerm> terms;
  Catalogue catalogue;  ///< the same terms, as the search sees them
};

/// Of every part of this arm. `top_speed_rad_per_s`: of each joint, for the Stribeck speeds to try.
/// `ripples_per_rev`: ripples to try in a turn of each joint, beside those of its motor.
ArmCatalogue arm_catalogue(const control::ArmDescription& arm, std::span<const double> top_speed_rad_per_s,
                           std::span<const double> ripples_per_rev);

}  // namespace identification::robot_gap
