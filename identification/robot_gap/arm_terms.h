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
#include "identification/gap/regression.h"

namespace identification::robot_gap {

/// One parameter: torques change with it nearly in proportion.
struct Term {
  enum class Kind : std::uint8_t {
    kPayloadMass,    ///< [kg], at constant first moment
    kPayloadMoment,  ///< mass times distance from the tip [kg·m], along x, y or z of T
    kLinkMass,       ///< [kg], at the centre of mass; the rotational inertia about it stays
    kLinkDensity,    ///< [kg]; the rotational inertia grows with it
    kLinkCentre,     ///< [m] in L
    kLinkInertia,    ///< [kg·m²] about the centre, in L
    kTilt,           ///< of gravity, about an axis of B [rad]
    kEncoderZero,    ///< [rad]
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
  bool operator==(const Term&) const = default;
};

/// "mass_kg"; in files and reports.
std::string term_name(const Term& term);
/// What the description holds. A lag has none.
double value_of(const Term& term, const control::ArmDescription& arm);
/// Allowed changes of the value.
gap::Bounds change_bounds(const Term& term, const control::ArmDescription& arm);
/// Adds to the value.
void change(control::ArmDescription& arm, const Term& term, double by);
/// Two unit axes of B about which gravity can tilt.
struct TiltAxes {
  Eigen::Vector3d first;
  Eigen::Vector3d second;
};
TiltAxes tilt_axes(const Eigen::Vector3d& gravity_B);

/// An effect of a part. Variants are alternatives of which the better one counts.
struct Candidate {
  std::string_view effect;         ///< "coulomb", as in gap.json
  int part = -1;                   ///< joint or link, from 0; −1: the whole arm
  std::vector<std::size_t> terms;  ///< among the catalogue's
  bool same_effect(const Candidate& other) const { return effect == other.effect && part == other.part; }
};

struct Catalogue {
  std::vector<Term> terms;
  std::vector<Candidate> candidates;  ///< simple ones first
};

/// Of every part of this arm. `top_speed_rad_per_s`: of each joint, for the Stribeck speeds to try.
/// `ripples_per_rev`: ripples to try in a turn of each joint, beside those of its motor.
Catalogue catalogue_of(const control::ArmDescription& arm, std::span<const double> top_speed_rad_per_s,
                       std::span<const double> ripples_per_rev);

/// A term's value: as in the description, and of a tilt the angle from the given gravity.
double reported_value(const Term& term, const control::ArmDescription& given,
                      const control::ArmDescription& arm);
/// term_name(), with the axis of a tilt.
std::string reported_name(const Term& term, const control::ArmDescription& given);

/// The chosen candidates alone, with their terms only.
Catalogue only(const Catalogue& catalogue, std::span<const std::size_t> chosen);

/// Name of joint or link; "tip", "base".
std::string part_name(const Candidate& candidate, const control::ArmDescription& arm);

}  // namespace identification::robot_gap
