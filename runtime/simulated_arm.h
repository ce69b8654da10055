/// @file
/// A simulated arm as a robot file describes it.
#pragma once
#include <array>

#include "control/robot_model.h"
#include "runtime/configuration/arm_model.h"
#include "sim/bus/axis_data.h"

namespace runtime {

/// Gives links, payload, friction and rotors of the model to the simulated robot; its base, end stops and
/// what its motor controllers are tuned for stay. Set-up.
void build_arm(const ArmModel& model, control::ModelChanges& masses,
               std::array<sim::bus::ArmJointData, control::kArmJoints>& joints);

}  // namespace runtime
