/// @file
/// The simulated operator of the demonstration.
#pragma once
#include <vector>

#include "sim/simulated_operator.h"

namespace operation {

/// For the scene in teleop.toml: reaches, follows a square, closes the gripper, drives far, touches the wall,
/// releases the handle.
std::vector<sim::Task> demo_tasks();

}  // namespace operation
