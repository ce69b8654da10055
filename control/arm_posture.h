/// @file
/// Arm joint angles for an end-effector pose, for starts and references; not for the cycle.
#pragma once
#include <optional>

#include "control/robot_model.h"
#include "control/tip_pose.h"

namespace control {

/// Solution nearest to `seed_rad` within the joint ranges, by damped Newton iteration, with the base at the
/// origin of W. Empty if the end effector stays more than 0.1 mm or 0.1 mrad off: five joints do not reach
/// every orientation. Setup.
std::optional<ArmVector> arm_posture_for(const TipPose& pose, const ArmVector& seed_rad, RobotModel& model);

}  // namespace control
