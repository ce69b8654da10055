/// @file
/// The arm's joints for a pose of the tip, for starts and references: not for the cycle.
#pragma once
#include <optional>

#include "control/robot_model.h"
#include "control/tip_pose.h"

namespace control {

/// With the base at the origin of W, the nearest solution that a damped Newton iteration finds from
/// `seed_rad` within the joints' ranges. None when the tip stays further off than 0.1 mm or 0.1 mrad: five
/// joints do not reach every orientation. Setup.
std::optional<ArmVector> arm_posture_for(const TipPose& pose, const ArmVector& seed_rad, RobotModel& model);

}  // namespace control
