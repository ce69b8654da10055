/// @file
/// Turns `--robot NAME` into a robot.
#pragma once
#include <chrono>
#include <memory>
#include <string>

#include "hal/clock.h"
#include "hal/robot.h"
#include "sim/base.h"

namespace apps {

struct OpenedRobot {
  std::unique_ptr<sim::Base> simulation;  ///< null when the robot is real
  std::unique_ptr<hal::Robot> robot;
};

/// `loopback`: the simulated base behind the HAL. `clock` outlives the result.
/// @throws std::invalid_argument for a name nobody knows, listing those there are.
OpenedRobot open_robot(const std::string& name, const sim::BaseParameters& simulation,
                       const hal::Clock& clock, std::chrono::nanoseconds period);

}  // namespace apps
