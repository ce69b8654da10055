/// @file
/// Parameters of a base that may be wrong, and the effects that change them.
#pragma once
#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "control/base_description.h"
#include "identification/robot_gap/base_motion.h"
#include "identification/robot_gap/subject.h"

namespace identification::robot_gap {

/// A parameter of the description.
struct BaseTerm {
  enum class Kind : std::uint8_t {
    kAllRadii,
    kRadius,
    kTurningLength,
    kSteeringOffset,
    kTrackingScale,
    kTrackingX,
    kTrackingY,
    kTrackingYaw,
    kSlipForward,
    kSlipSideways,
    kSlipWithLoad,
    kFloorSlip,
    // From here on, of forces.
    kMass,
    kYawInertia,
    kCentreX,
    kCentreY,
    kAllTorques,
    kTorque,
    kTorqueOffset,
    kAllCoulomb,
    kCoulomb,
    kAllViscous,
    kViscous,
    kAllInertias,
    kInertia,
    kSlopeX,
    kSlopeY,
    kSidewaysResistance,
    kTurningResistance,
    kFloorResistance
  };
  Kind kind = Kind::kAllRadii;
  std::size_t index = 0;  ///< wheel or floor
  double step = 0;        ///< for a derivative
  bool of_forces() const noexcept { return kind >= Kind::kMass; }
  /// Dissipation or inertia: changed() keeps it from being negative, and its derivative steps upwards.
  bool is_positive() const noexcept {
    return kind == Kind::kYawInertia || (kind >= Kind::kAllCoulomb && kind <= Kind::kInertia) ||
           kind >= Kind::kSidewaysResistance;
  }
};

struct BaseCatalogue {
  Catalogue catalogue;
  std::vector<BaseTerm> terms;  ///< as those of the catalogue
};

/// What can be wrong with a base in these recordings. `with_forces`: their torques are compared.
BaseCatalogue base_catalogue(const control::BaseDescription& given, std::span<const BaseRecording> recordings,
                             bool with_forces);

/// The description with a change of every term. Changes that add up to a negative friction or inertia of a
/// wheel, yaw inertia, or resistance to sideways motion, to turning or of a floor make it zero. A radius
/// stays at least a quarter of the given one.
control::BaseDescription changed(const control::BaseDescription& given, const BaseCatalogue& all,
                                 const Eigen::VectorXd& changes);

}  // namespace identification::robot_gap
